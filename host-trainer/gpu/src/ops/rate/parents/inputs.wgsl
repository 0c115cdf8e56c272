@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read> parents: array<u32>;
@group(0) @binding(2) var<storage, read> given: array<f32>;
@group(0) @binding(3) var<storage, read> anchors: array<u32>;
@group(0) @binding(4) var<storage, read_write> network_inputs: array<f32>;

@compute @workgroup_size(256)
fn inputs(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let row = i / parameters.width;
    let column = i - row * parameters.width;
    let anchor = anchors[row];
    if column < 3u {
        network_inputs[i] = positions[3u * anchor + column];
    } else {
        network_inputs[i] = given[parents[anchor] * (parameters.width - 3u) + column - 3u];
    }
}

struct Parameters {
    n_rows: u32,
    stream: u32,
    draw: u32,
    share: f32,
}

@group(0) @binding(0) var<storage, read> anchors: array<u32>;
@group(0) @binding(1) var<storage, read> view_weights: array<f32>;
@group(0) @binding(2) var<storage, read_write> marks: array<u32>;

var<immediate> parameters: Parameters;

@compute @workgroup_size(256)
fn mark(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = item_of(group, thread);
    if row < parameters.n_rows {
        let anchor = anchors[row];
        let draw = uniform_of(branch_of(parameters.stream, anchor), parameters.draw);
        marks[row] = u32(draw < parameters.share * view_weights[anchor]);
    }
}

@group(0) @binding(0) var<storage, read> features: array<f32>;
@group(0) @binding(1) var<storage, read> log_scales: array<f32>;
@group(0) @binding(2) var<storage, read> anchors: array<u32>;
@group(0) @binding(3) var<storage, read_write> given: array<f32>;

@compute @workgroup_size(256)
fn give(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let n_given = parameters.width + parameters.n_log_scales;
    let row = i / n_given;
    let column = i - row * n_given;
    var share: f32;
    if column < parameters.width {
        share = features[row * parameters.width + column] * parameters.per_unit[0];
    } else {
        share = log_scales[row * parameters.n_log_scales + column - parameters.width] * parameters.per_unit[1];
    }
    given[anchors[row] * n_given + column] = clamp(share, -1.0, 1.0);
}

@group(0) @binding(0) var<storage, read> steps: array<f32>;
@group(0) @binding(1) var<storage, read_write> values: array<f32>;
@group(0) @binding(2) var<storage, read_write> residuals: array<f32>;
@group(0) @binding(3) var<storage, read> anchors: array<u32>;

@compute @workgroup_size(256)
fn with_noise(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let row = i / parameters.width;
    if row >= parameters.n_rows {
        return;
    }
    let channel = parameters.first + i - row * parameters.width;
    let residual = uniform_of(branch_of(parameters.stream, anchors[row]), channel) - 0.5;
    residuals[i] = residual;
    values[i] += residual * steps[3u * row + parameters.group];
}

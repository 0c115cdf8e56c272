@group(0) @binding(0) var<storage, read> high_frequencies: array<f32>;
@group(0) @binding(1) var<storage, read> blurred_across: array<f32>;
@group(0) @binding(2) var<storage, read_write> d_image: array<f32>;

@compute @workgroup_size(256)
fn backward(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) n_groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let i = item_of(group, n_groups, thread);
    if i >= n_values() {
        return;
    }
    let width = parameters.size_px[0];
    let height = parameters.size_px[1];
    let y = i / width % height;
    let window = parameters.window;
    var low = 0.0;
    for (var tap = 0u; tap < 2u * RADIUS + 1u; tap++) {
        if y + tap >= RADIUS && y + tap < height + RADIUS {
            low += window[tap] * blurred_across[i + tap * width - RADIUS * width];
        }
    }
    d_image[i] += parameters.slope * (high_frequencies[i] - low);
}

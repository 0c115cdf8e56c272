@group(0) @binding(0) var<storage, read> planes: array<f32>;
@group(0) @binding(1) var<storage, read_write> blurred_across: array<f32>;

@compute @workgroup_size(256)
fn across(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= n_values() {
        return;
    }
    let width = parameters.size_px[0];
    let x = i % width;
    let window = parameters.window;
    var sum = 0.0;
    for (var tap = 0u; tap < 2u * RADIUS + 1u; tap++) {
        if x + tap >= RADIUS && x + tap < width + RADIUS {
            sum += window[tap] * planes[i + tap - RADIUS];
        }
    }
    blurred_across[i] = sum;
}

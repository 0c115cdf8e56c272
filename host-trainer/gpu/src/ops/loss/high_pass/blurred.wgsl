@group(0) @binding(1) var<storage, read> blurred_across: array<f32>;

// Value i, blurred down too.
fn blurred(i: u32) -> f32 {
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
    return low;
}

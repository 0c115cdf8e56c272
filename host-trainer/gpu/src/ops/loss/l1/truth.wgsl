// Values of an 8-bit photograph, which is the same in all planes of an image.

struct Parameters {
    n_pixels: u32,
    step: f32,
}

var<immediate> parameters: Parameters;

fn truth_of(pixel: u32, channel: u32) -> f32 {
    return f32((pixel >> (8u * channel)) & 255u) / 255.0;
}

// A difference of less than what a division may err is none.
fn difference(value: f32, truth: f32) -> f32 {
    let d = value - truth;
    return select(d, 0.0, abs(d) <= 2e-7);
}

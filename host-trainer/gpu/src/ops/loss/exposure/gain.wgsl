// The gains of the channels.

struct Parameters {
    n_pixels: u32,
    gain: array<f32, 3>,
    foot: f32,
}

var<immediate> parameters: Parameters;

fn gain_of(value: u32) -> f32 {
    return parameters.gain[value / parameters.n_pixels];
}

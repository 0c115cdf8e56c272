struct Parameters {
    size_px: array<u32, 2>,
    slope: f32,
    window: array<f32, 11>,
}

var<immediate> parameters: Parameters;

const RADIUS: u32 = 5u;

fn n_values() -> u32 {
    return 3u * parameters.size_px[0] * parameters.size_px[1];
}

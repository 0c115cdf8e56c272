struct Parameters {
    n_rows: u32,
    width: u32,
    divergence: f32,
    spread: f32,
    variance_floor: f32,
}

var<immediate> parameters: Parameters;

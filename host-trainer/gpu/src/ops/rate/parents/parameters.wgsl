struct Parameters {
    n_items: u32,
    level: u32,
    width: u32,
    n_log_scales: u32,
    per_unit: array<f32, 2>,
}

var<immediate> parameters: Parameters;

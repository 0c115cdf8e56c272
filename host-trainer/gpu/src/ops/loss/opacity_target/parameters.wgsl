struct Parameters {
    n_slots: u32,
    first_total: u32,
    target_sum: f32,
    slope: f32,
}

var<immediate> parameters: Parameters;

struct Parameters {
    n_slots: u32,
    first_total: u32,
    weight: f32,
}

var<immediate> parameters: Parameters;

struct Parameters {
    n_values: u32,
    weight: f32,
    margin: f32,
}

var<immediate> parameters: Parameters;

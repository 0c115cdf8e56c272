struct Parameters {
    base_steps: array<f32, 3>,
    exponents: array<f32, 2>,
    n_values: u32,
}

var<immediate> parameters: Parameters;

struct Parameters {
    centre_world: array<f32, 3>,
    n_rows: u32,
    feature_dim: u32,
    n_inputs: u32,
    view_distance: u32,
}

var<immediate> parameters: Parameters;

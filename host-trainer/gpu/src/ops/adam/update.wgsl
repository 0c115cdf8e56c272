struct Parameters {
    n_values: u32,
    width: u32,
    scale: f32,
    second_correction: f32,
    first_shares: array<f32, 2>,
    second_shares: array<f32, 2>,
    epsilon: f32,
}

@group(0) @binding(0) var<storage, read_write> values: array<f32>;
@group(0) @binding(1) var<storage, read_write> first: array<f32>;
@group(0) @binding(2) var<storage, read_write> second: array<f32>;
@group(0) @binding(3) var<storage, read> gradient: array<f32>;

var<immediate> parameters: Parameters;

fn update(i: u32, g: f32) {
    let m = parameters.first_shares[0] * first[i] + parameters.first_shares[1] * g;
    let v = parameters.second_shares[0] * second[i] + parameters.second_shares[1] * (g * g);
    first[i] = m;
    second[i] = v;
    values[i] -= parameters.scale * m / (sqrt(v) * parameters.second_correction + parameters.epsilon);
}

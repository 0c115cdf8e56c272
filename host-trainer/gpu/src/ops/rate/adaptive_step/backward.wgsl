@group(0) @binding(0) var<storage, read> exponents: array<f32>;
@group(0) @binding(1) var<storage, read> steps: array<f32>;
@group(0) @binding(2) var<storage, read> d_steps: array<f32>;
@group(0) @binding(3) var<storage, read_write> d_exponents: array<f32>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_values {
        return;
    }
    let gradient = d_steps[i] * steps[i] * LN_2;
    let above = exponents[i] > parameters.exponents[1] && gradient < 0.0;
    let below = exponents[i] < parameters.exponents[0] && gradient > 0.0;
    // Outside the range only the way back is open.
    d_exponents[i] += select(gradient, 0.0, above || below);
}

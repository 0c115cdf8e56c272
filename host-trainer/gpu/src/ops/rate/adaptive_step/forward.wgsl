@group(0) @binding(0) var<storage, read> exponents: array<f32>;
@group(0) @binding(1) var<storage, read_write> steps: array<f32>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < parameters.n_values {
        let exponent = clamp(exponents[i], parameters.exponents[0], parameters.exponents[1]);
        steps[i] = parameters.base_steps[i % 3u] * exp_of(exponent * LN_2);
    }
}

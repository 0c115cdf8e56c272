// The step of an exponent in eighths of an octave, from a table of all that there are.

@group(0) @binding(0) var<storage, read> exponents: array<f32>;
// [32, 3], from the smallest exponent on.
@group(0) @binding(1) var<storage, read> table: array<f32>;
@group(0) @binding(2) var<storage, read_write> steps: array<f32>;

var<immediate> n_values: u32;

@compute @workgroup_size(256)
fn steps_of_exponents(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= n_values {
        return;
    }
    let eighths = clamp(i32(exponents[i] * 8.0), -24, 7);
    steps[i] = table[u32(eighths + 24) * 3u + i % 3u];
}

@group(0) @binding(0) var<storage, read> difference: array<f32>;
@group(0) @binding(2) var<storage, read_write> high_frequencies: array<f32>;

@compute @workgroup_size(256)
fn high(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= n_values() {
        return;
    }
    high_frequencies[i] = difference[i] - blurred(i);
}

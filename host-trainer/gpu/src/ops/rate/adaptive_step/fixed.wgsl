@group(0) @binding(0) var<storage, read_write> steps: array<f32>;

@compute @workgroup_size(256)
fn fixed(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < parameters.n_values {
        steps[i] = parameters.base_steps[i % 3u];
    }
}

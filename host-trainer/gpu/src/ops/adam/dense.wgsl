@compute @workgroup_size(256)
fn dense(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < parameters.n_values {
        update(i, gradient[i]);
    }
}

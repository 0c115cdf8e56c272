@group(0) @binding(0) var<storage, read> features: array<f32>;
@group(0) @binding(1) var<storage, read> positions: array<f32>;
@group(0) @binding(2) var<storage, read_write> head_input: array<f32>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let row = i / parameters.n_inputs;
    if row >= parameters.n_rows {
        return;
    }
    let column = i - row * parameters.n_inputs;
    if column < parameters.feature_dim {
        head_input[i] = features[row * parameters.feature_dim + column];
        return;
    }
    let centre = vec3(parameters.centre_world[0], parameters.centre_world[1], parameters.centre_world[2]);
    let ray = vec3(positions[3u * row], positions[3u * row + 1u], positions[3u * row + 2u]) - centre;
    let distance = sqrt(ray.x * ray.x + ray.y * ray.y + ray.z * ray.z);
    let of_view = column - parameters.feature_dim;
    if of_view < parameters.view_distance {
        head_input[i] = distance;
        return;
    }
    var inverse = 0.0;
    if distance > 0.0 {
        inverse = 1.0 / distance;
    }
    head_input[i] = ray[of_view - parameters.view_distance] * inverse;
}

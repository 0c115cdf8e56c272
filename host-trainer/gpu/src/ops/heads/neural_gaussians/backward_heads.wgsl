@group(0) @binding(0) var<storage, read> covariances: array<f32>;
@group(0) @binding(1) var<storage, read> colour_logits: array<f32>;
@group(0) @binding(2) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(3) var<storage, read> d_gaussians: array<Gaussian>;
@group(0) @binding(4) var<storage, read_write> d_opacity_logits: array<f32>;
@group(0) @binding(5) var<storage, read_write> d_covariances: array<f32>;
@group(0) @binding(6) var<storage, read_write> d_colour_logits: array<f32>;

@compute @workgroup_size(256)
fn backward_heads(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_items {
        return;
    }
    let g = gaussians[slot];
    let first = slot * parameters.n_covariances;
    if g.opacity <= 0.0 {
        d_opacity_logits[slot] = 0.0;
        for (var i = 0u; i < 3u; i++) {
            d_colour_logits[3u * slot + i] = 0.0;
        }
        for (var i = 0u; i < parameters.n_covariances; i++) {
            d_covariances[first + i] = 0.0;
        }
        return;
    }
    let d = d_gaussians[slot];
    d_opacity_logits[slot] = d.opacity * (1.0 - g.opacity * g.opacity);
    for (var i = 0u; i < 3u; i++) {
        // Not the Gaussian's colour, to which others may have added.
        let colour = sigmoid_of(colour_logits[3u * slot + i]);
        d_colour_logits[3u * slot + i] = d.colour[i] * colour * (1.0 - colour);
    }
    if parameters.n_covariances == 1u {
        let sigma = sigmoid_of(covariances[first]);
        let along = d.scale[0] * g.scale[0] + d.scale[1] * g.scale[1] + d.scale[2] * g.scale[2];
        d_covariances[first] = along * (1.0 - sigma);
        return;
    }
    for (var i = 0u; i < 3u; i++) {
        let sigma = sigmoid_of(covariances[first + i]);
        d_covariances[first + i] = d.scale[i] * g.scale[i] * (1.0 - sigma);
    }
    let raw = vec4(covariances[first + 3u], covariances[first + 4u], covariances[first + 5u], covariances[first + 6u]);
    let unit = vec4(g.rotation[0], g.rotation[1], g.rotation[2], g.rotation[3]);
    let d_unit = vec4(d.rotation[0], d.rotation[1], d.rotation[2], d.rotation[3]);
    let norm = sqrt(dot(raw, raw));
    // Below the floor the division is by a constant, and nothing is projected out.
    let radial = select(0.0, dot(unit, d_unit), norm > NORM_FLOOR);
    let d_raw = (d_unit - unit * radial) * (1.0 / max(norm, NORM_FLOOR));
    for (var i = 0u; i < 4u; i++) {
        d_covariances[first + 3u + i] = d_raw[i];
    }
}

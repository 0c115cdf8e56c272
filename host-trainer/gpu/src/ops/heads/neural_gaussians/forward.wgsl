@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read> log_scales: array<f32>;
@group(0) @binding(2) var<storage, read> offsets: array<f32>;
@group(0) @binding(3) var<storage, read> mask_logits: array<f32>;
@group(0) @binding(4) var<storage, read> opacity_logits: array<f32>;
@group(0) @binding(5) var<storage, read> covariances: array<f32>;
@group(0) @binding(6) var<storage, read> colour_logits: array<f32>;
@group(0) @binding(7) var<storage, read_write> gaussians: array<Gaussian>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_items {
        return;
    }
    var gaussian: Gaussian;
    if mask_logits[slot] > parameters.mask_threshold {
        let opacity = tanh_of(opacity_logits[slot]);
        if opacity > 0.0 {
            gaussian = gaussian_of(slot, opacity);
        }
    }
    gaussians[slot] = gaussian;
}

fn gaussian_of(slot: u32, opacity: f32) -> Gaussian {
    var gaussian: Gaussian;
    gaussian.opacity = opacity;
    let row = slot / parameters.n_offsets;
    let first_size = row * parameters.n_log_scales;
    let first = slot * parameters.n_covariances;
    for (var i = 0u; i < 3u; i++) {
        let extent = exp_of(log_scales[first_size + i]);
        gaussian.centre[i] = positions[3u * row + i] + offsets[3u * slot + i] * extent;
        gaussian.colour[i] = sigmoid_of(colour_logits[3u * slot + i]);
    }
    if parameters.n_covariances == 1u {
        let size = exp_of(log_scales[first_size + 3u]) * sigmoid_of(covariances[first]);
        gaussian.scale = array(size, size, size);
        gaussian.rotation = array(1.0, 0.0, 0.0, 0.0);
        return gaussian;
    }
    for (var i = 0u; i < 3u; i++) {
        gaussian.scale[i] = exp_of(log_scales[first_size + 3u + i]) * sigmoid_of(covariances[first + i]);
    }
    let raw = vec4(covariances[first + 3u], covariances[first + 4u], covariances[first + 5u], covariances[first + 6u]);
    let unit = raw * (1.0 / max(sqrt(dot(raw, raw)), NORM_FLOOR));
    gaussian.rotation = array(unit.x, unit.y, unit.z, unit.w);
    return gaussian;
}

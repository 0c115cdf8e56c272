// A thread is an anchor, so that its offsets are added up in their order.

@group(0) @binding(0) var<storage, read> log_scales: array<f32>;
@group(0) @binding(1) var<storage, read> offsets: array<f32>;
@group(0) @binding(2) var<storage, read> mask_logits: array<f32>;
@group(0) @binding(3) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(4) var<storage, read> d_gaussians: array<Gaussian>;
@group(0) @binding(5) var<storage, read_write> d_log_scales: array<f32>;
@group(0) @binding(6) var<storage, read_write> d_offsets: array<f32>;
@group(0) @binding(7) var<storage, read_write> d_mask_logits: array<f32>;

@compute @workgroup_size(256)
fn backward_anchors(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = item_of(group, thread);
    if row >= parameters.n_items {
        return;
    }
    let first_size = row * parameters.n_log_scales;
    let extent = vec3(
        exp_of(log_scales[first_size]),
        exp_of(log_scales[first_size + 1u]),
        exp_of(log_scales[first_size + 2u]),
    );
    var d_extent = vec3<f32>(0.0);
    var d_size = vec3<f32>(0.0);
    for (var k = 0u; k < parameters.n_offsets; k++) {
        let slot = row * parameters.n_offsets + k;
        let g = gaussians[slot];
        var d_offset = vec3<f32>(0.0);
        var d_mask = 0.0;
        if g.opacity > 0.0 {
            let d = d_gaussians[slot];
            let open = sigmoid_of(mask_logits[slot]);
            d_mask = d.opacity * g.opacity * (open * (1.0 - open));
            d_offset = vec3(d.centre[0], d.centre[1], d.centre[2]) * extent;
            d_extent += d_offset * vec3(offsets[3u * slot], offsets[3u * slot + 1u], offsets[3u * slot + 2u]);
            d_size += vec3(d.scale[0] * g.scale[0], d.scale[1] * g.scale[1], d.scale[2] * g.scale[2]);
        }
        d_mask_logits[slot] = d_mask;
        for (var i = 0u; i < 3u; i++) {
            d_offsets[3u * slot + i] = d_offset[i];
        }
    }
    for (var i = 0u; i < 3u; i++) {
        d_log_scales[first_size + i] = d_extent[i];
    }
    if parameters.n_log_scales == 4u {
        d_log_scales[first_size + 3u] = d_size.x + d_size.y + d_size.z;
        return;
    }
    for (var i = 0u; i < 3u; i++) {
        d_log_scales[first_size + 3u + i] = d_size[i];
    }
}

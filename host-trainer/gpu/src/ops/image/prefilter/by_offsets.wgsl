@group(0) @binding(5) var<storage, read> offsets: array<f32>;

@compute @workgroup_size(256)
fn by_offsets(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let anchor = item_of(group, thread);
    if anchor >= parameters.n_anchors {
        return;
    }
    var found = false;
    if is_kept(anchor) {
        let position = position_of(anchor);
        let extent = extent_of(anchor);
        var widest = 0.0;
        for (var i = 3u; i < parameters.n_log_scales; i++) {
            widest = max(widest, exp_of(log_scales[anchor * parameters.n_log_scales + i]));
        }
        let radius = parameters.ink_deviations * widest;
        for (var k = 0u; k < parameters.n_offsets && !found; k++) {
            let offset = anchor * parameters.n_offsets + k;
            if is_open(offset) {
                let along = vec3(offsets[3u * offset], offsets[3u * offset + 1u], offsets[3u * offset + 2u]);
                found = offset_reaches(position + along * extent, radius);
            }
        }
    }
    is_visible[anchor] = u32(found);
}

// Whether a ball of ink may reach the image: offset_reaches of ops/image/prefilter.rs.
fn offset_reaches(centre: vec3<f32>, radius: f32) -> bool {
    let point_cam = world_to_camera(centre);
    let z = point_cam.z;
    if !(z > parameters.near) {
        return false;
    }
    let slope = point_cam.xy / z;
    let t = clamped(slope);
    let reach = radius * focal() / z * sqrt(1.0 + t * t) + parameters.dilation_reach_px;
    return overlaps_image(focal() * slope + principal(), reach);
}

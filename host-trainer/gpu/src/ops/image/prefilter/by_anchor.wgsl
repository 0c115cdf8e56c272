@compute @workgroup_size(256)
fn by_anchor(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let anchor = item_of(group, thread);
    if anchor >= parameters.n_anchors {
        return;
    }
    var found = false;
    if is_kept(anchor) {
        for (var k = 0u; k < parameters.n_offsets; k++) {
            found = found || is_open(anchor * parameters.n_offsets + k);
        }
        found = found && anchor_is_visible(position_of(anchor), extent_of(anchor));
    }
    is_visible[anchor] = u32(found);
}

// The anchor as a Gaussian without rotation: anchor_is_visible of ops/image/prefilter.rs.
fn anchor_is_visible(position: vec3<f32>, size: vec3<f32>) -> bool {
    let point_cam = world_to_camera(position);
    let z = point_cam.z;
    if !(z > parameters.near) {
        return false;
    }
    let slope = point_cam.xy / z;
    let t = clamped(slope);
    let lever = focal() / z;
    var cov = vec3(parameters.dilation_px2, 0.0, parameters.dilation_px2);
    for (var axis = 0u; axis < 3u; axis++) {
        let r = parameters.rotation;
        let column = vec3(r[axis], r[axis + 3u], r[axis + 6u]) * size[axis];
        let ab = lever * (column.xy - t * column.z);
        cov += vec3(ab.x * ab.x, ab.x * ab.y, ab.y * ab.y);
    }
    let half_difference = 0.5 * (cov.x - cov.z);
    let spread = half_difference * half_difference + cov.y * cov.y;
    let lambda_max = 0.5 * (cov.x + cov.z) + sqrt(max(spread, 0.1));
    let radius = ceil(3.0 * sqrt(lambda_max));
    return overlaps_image(focal() * slope + principal(), vec2(radius));
}

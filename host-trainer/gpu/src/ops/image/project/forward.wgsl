@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read_write> splats: array<Splat>;
@group(0) @binding(2) var<storage, read_write> footprints: array<Footprint>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_slots {
        return;
    }
    var splat: Splat;
    var footprint: Footprint;
    let gaussian = gaussians[slot];
    // Most slots without a Gaussian leave here.
    if gaussian.opacity > ALPHA_CUTOFF {
        project(gaussian, &splat, &footprint);
    }
    splats[slot] = splat;
    footprints[slot] = footprint;
}

fn project(gaussian: Gaussian, splat: ptr<function, Splat>, footprint: ptr<function, Footprint>) {
    let p = prepare(gaussian);
    if !p.is_drawn {
        return;
    }
    var opacity = gaussian.opacity;
    if parameters.compensated != 0u {
        opacity *= compensation(p);
    }
    if !(opacity > ALPHA_CUTOFF) {
        return;
    }
    let focal = vec2(parameters.focal_px[0], parameters.focal_px[1]);
    let principal = vec2(parameters.principal_px[0], parameters.principal_px[1]);
    let last = vec2(parameters.size_px[0], parameters.size_px[1]) - 0.5;
    let mean = focal * (p.point_cam.xy / p.point_cam.z) + principal;
    let reach = 2.0 * ln_of(opacity * 255.0);
    let half_extent = sqrt(reach * vec2(p.cov.x, p.cov.z));
    if !(all(mean + half_extent >= vec2(0.5)) && all(mean - half_extent <= last)) {
        return;
    }
    (*splat).mean_px = array(mean.x, mean.y);
    (*splat).shear = p.cov.y / p.cov.z;
    (*splat).row_precision = p.cov.z / p.det;
    (*splat).column_precision = 1.0 / p.cov.z;
    (*splat).opacity = opacity;
    (*splat).colour = gaussian.colour;
    (*footprint).depth = p.point_cam.z;
    (*footprint).half_extent_px = array(half_extent.x, half_extent.y);
}

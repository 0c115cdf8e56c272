@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read> footprints: array<Footprint>;
@group(0) @binding(2) var<storage, read> d_splats: array<Splat>;
@group(0) @binding(3) var<storage, read_write> d_gaussians: array<Gaussian>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_slots || footprints[slot].depth <= 0.0 {
        return;
    }
    let d = project_backward(gaussians[slot], d_splats[slot]);
    for (var i = 0u; i < 3u; i++) {
        d_gaussians[slot].centre[i] += d.centre[i];
        d_gaussians[slot].scale[i] += d.scale[i];
        d_gaussians[slot].colour[i] += d.colour[i];
    }
    for (var i = 0u; i < 4u; i++) {
        d_gaussians[slot].rotation[i] += d.rotation[i];
    }
    d_gaussians[slot].opacity += d.opacity;
}

fn project_backward(gaussian: Gaussian, d_splat: Splat) -> Gaussian {
    var d: Gaussian;
    d.colour = d_splat.colour;
    d.opacity = d_splat.opacity;
    let p = prepare(gaussian);
    if !p.is_drawn {
        return d;
    }

    // dL/dT and the stretches: ellipse_gradient of ops/image/project.rs.
    let k = 1.0 / p.cov.z;
    let shear = p.cov.y * k;
    let along_row = p.cov.z / p.det;
    let rest = k * (DILATION_PX2 * p.t0 + cross(p.t1, p.t_cross));
    let along = 2.0 * along_row * along_row * d_splat.row_precision;
    let sideways = k * d_splat.shear;
    let across = 2.0 * k * k * d_splat.column_precision;
    var d_t0 = sideways * p.t1 - along * rest;
    var d_t1 = (along * shear + sideways) * rest - (sideways * shear + across) * p.t1;
    var stretch = (2.0 * sideways * p.t1 - along * rest) * rest - across * p.t1 * p.t1;

    if parameters.compensated != 0u {
        // add_compensation_gradient of ops/image/project.rs.
        let share = compensation(p);
        if share > 0.0 {
            let scaled = d_splat.opacity * gaussian.opacity / (share * p.det);
            let kept = p.det_added / p.det;
            let lost = DILATION_PX2 * (p.det_sharp / p.det);
            let part0 = scaled * (kept * cross(p.t1, p.t_cross) - lost * p.t0);
            let part1 = scaled * (kept * cross(p.t_cross, p.t0) - lost * p.t1);
            d_t0 += part0;
            d_t1 += part1;
            stretch += part0 * p.t0 + part1 * p.t1;
        }
        d.opacity = d_splat.opacity * share;
    }

    let z = p.point_cam.z;
    let scale = vec3_of(gaussian.scale);
    var d_z = -(stretch.x + stretch.y + stretch.z) / z;
    d.scale = array_of(select(vec3(0.0), stretch / scale, scale > vec3(0.0)));
    let depth_row = transpose(p.axes_cam)[2];
    let scaled0 = d_t0 * (parameters.focal_px[0] / z) * scale;
    let scaled1 = d_t1 * (parameters.focal_px[1] / z) * scale;
    let d_depth_row = -scaled0 * p.slope.x - scaled1 * p.slope.y;
    let d_slope = vec2(-dot(scaled0, depth_row), -dot(scaled1, depth_row));

    let focal = vec2(parameters.focal_px[0], parameters.focal_px[1]);
    let d_exact = vec2(d_splat.mean_px[0], d_splat.mean_px[1]) * focal + select(vec2(0.0), d_slope, p.free);
    d_z += -d_exact.x * p.point_cam.x / (z * z) - d_exact.y * p.point_cam.y / (z * z);
    let to_world = transpose(world_to_camera());
    d.centre = array_of(to_world * vec3(d_exact / z, d_z));

    // axes = W·R(q), so dR = Wᵀ·d_axes; columns.
    let d_rotation = to_world * transpose(mat3x3(scaled0, scaled1, d_depth_row));
    d.rotation = quaternion_gradient(gaussian.rotation, d_rotation);
    return d;
}

// dL/dq for L depending on R(q): m[j][i] is dL/dR[i][j].
fn quaternion_gradient(q: array<f32, 4>, m: mat3x3<f32>) -> array<f32, 4> {
    let w = q[0];
    let x = q[1];
    let y = q[2];
    let z = q[3];
    let turn = vec3(m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0]);
    let xy = m[0][1] + m[1][0];
    let xz = m[0][2] + m[2][0];
    let yz = m[1][2] + m[2][1];
    return array(
        2.0 * (x * turn.x + y * turn.y + z * turn.z),
        2.0 * (y * xy + z * xz + w * turn.x - 2.0 * x * (m[1][1] + m[2][2])),
        2.0 * (x * xy + z * yz + w * turn.y - 2.0 * y * (m[0][0] + m[2][2])),
        2.0 * (x * xz + y * yz + w * turn.z - 2.0 * z * (m[0][0] + m[1][1])),
    );
}

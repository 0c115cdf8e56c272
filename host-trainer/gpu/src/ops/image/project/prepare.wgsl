// What forward and backward of ops/image/project.rs both compute.

// Words 0 to 24 of the parameters are the camera.
struct Parameters {
    rotation: array<f32, 9>,
    translation: array<f32, 3>,
    focal_px: array<f32, 2>,
    principal_px: array<f32, 2>,
    size_px: array<f32, 2>,
    slope_low: array<f32, 2>,
    slope_high: array<f32, 2>,
    compensated: u32,
    n_slots: u32,
}

var<immediate> parameters: Parameters;

const NEAR: f32 = 0.2;
const DILATION_PX2: f32 = 0.3;
const ALPHA_CUTOFF: f32 = 1.0 / 255.0;
const F32_MAX: f32 = 3.4028234e38;

struct Projection {
    point_cam: vec3<f32>,
    slope: vec2<f32>,
    free: vec2<bool>,
    // W·R(q), columns.
    axes_cam: mat3x3<f32>,
    // The rows of J·W·R(q)·S.
    t0: vec3<f32>,
    t1: vec3<f32>,
    t_cross: vec3<f32>,
    // [xx, xy, yy].
    cov: vec3<f32>,
    det_sharp: f32,
    det_added: f32,
    det: f32,
    is_drawn: bool,
}

fn vec3_of(a: array<f32, 3>) -> vec3<f32> {
    return vec3(a[0], a[1], a[2]);
}

fn array_of(v: vec3<f32>) -> array<f32, 3> {
    return array(v.x, v.y, v.z);
}

// World to camera: columns, where the parameters have rows.
fn world_to_camera() -> mat3x3<f32> {
    let r = parameters.rotation;
    return mat3x3(r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]);
}

// R(q) of a unit quaternion (w, x, y, z), columns.
fn rotation_matrix(q: array<f32, 4>) -> mat3x3<f32> {
    let w = q[0];
    let x = q[1];
    let y = q[2];
    let z = q[3];
    return mat3x3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y),
    );
}

fn lever(focal_px: f32, z: f32, row: vec3<f32>, depth_row: vec3<f32>, slope: f32, scale: vec3<f32>) -> vec3<f32> {
    return (focal_px / z) * (row - slope * depth_row) * scale;
}

fn prepare(gaussian: Gaussian) -> Projection {
    var p: Projection;
    let camera = world_to_camera();
    p.point_cam = camera * vec3_of(gaussian.centre) + vec3_of(parameters.translation);
    let z = p.point_cam.z;
    if !(z > NEAR) {
        return p;
    }
    let low = vec2(parameters.slope_low[0], parameters.slope_low[1]);
    let high = vec2(parameters.slope_high[0], parameters.slope_high[1]);
    let exact = p.point_cam.xy / z;
    p.slope = clamp(exact, low, high);
    p.free = p.slope == exact;
    p.axes_cam = camera * rotation_matrix(gaussian.rotation);
    let rows = transpose(p.axes_cam);
    let scale = vec3_of(gaussian.scale);
    p.t0 = lever(parameters.focal_px[0], z, rows[0], rows[2], p.slope.x, scale);
    p.t1 = lever(parameters.focal_px[1], z, rows[1], rows[2], p.slope.y, scale);
    let squares = vec2(dot(p.t0, p.t0), dot(p.t1, p.t1));
    // A sum of positive terms (Cauchy-Binet), where the determinant of the covariance would cancel.
    p.t_cross = cross(p.t0, p.t1);
    p.det_sharp = dot(p.t_cross, p.t_cross);
    p.det_added = DILATION_PX2 * (squares.x + squares.y) + DILATION_PX2 * DILATION_PX2;
    p.det = p.det_sharp + p.det_added;
    p.cov = vec3(squares.x + DILATION_PX2, dot(p.t0, p.t1), squares.y + DILATION_PX2);
    // NaN leaves as well.
    p.is_drawn = p.det <= F32_MAX;
    return p;
}

// The share of its opacity that a dilated splat keeps.
fn compensation(p: Projection) -> f32 {
    return sqrt(p.det_sharp / p.det);
}

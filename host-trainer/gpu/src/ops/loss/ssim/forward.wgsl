@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read> truth: array<u32>;
// [3, height, width, 3]: by μₓ, E[x² + y²], E[xy].
@group(0) @binding(2) var<storage, read_write> partials: array<f32>;
// [workgroups].
@group(0) @binding(3) var<storage, read_write> parts: array<f32>;

const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

var<workgroup> values: array<vec2<f32>, PADDED * PADDED>;
// x, y, x² + y², xy, blurred along rows.
var<workgroup> across: array<vec4<f32>, PADDED * EDGE>;
var<workgroup> sums: array<f32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(group_of(group));
    if place.channel >= 3u {
        return;
    }
    let width = parameters.size_px[0];
    let plane = place.channel * width * parameters.size_px[1];
    for (var i = thread; i < PADDED * PADDED; i += GROUP_THREADS) {
        let pixel = pixel_of(place, i);
        var value = vec2(0.0);
        if is_inside(pixel) {
            let at = u32(pixel.y) * width + u32(pixel.x);
            value = vec2(image[plane + at], f32((truth[at] >> (8u * place.channel)) & 255u) / 255.0);
        }
        values[i] = value;
    }
    workgroupBarrier();
    for (var i = thread; i < PADDED * EDGE; i += GROUP_THREADS) {
        let first = i / EDGE * PADDED + i % EDGE;
        var m = vec4(0.0);
        for (var tap = 0u; tap < 11u; tap++) {
            let w = parameters.window[tap];
            let value = values[first + tap];
            m += w * vec4(value, dot(value, value), value.x * value.y);
        }
        across[i] = m;
    }
    workgroupBarrier();
    var m = vec4(0.0);
    for (var tap = 0u; tap < 11u; tap++) {
        m += parameters.window[tap] * across[(thread / EDGE + tap) * EDGE + thread % EDGE];
    }
    let x = place.x0 + thread % EDGE;
    let y = place.y0 + thread / EDGE;
    var s = 0.0;
    if x < width && y < parameters.size_px[1] {
        let mx = m.x;
        let my = m.y;
        let a1 = 2.0 * mx * my + C1;
        let a2 = 2.0 * (m.w - mx * my) + C2;
        let b1 = mx * mx + my * my + C1;
        let b2 = m.z - (mx * mx + my * my) + C2;
        let inverse = 1.0 / (b1 * b2);
        s = a1 * a2 * inverse;
        let d_squares = -s / b2;
        let d_xy = 2.0 * a1 * inverse;
        let d_mx = 2.0 * my * a2 * inverse - 2.0 * mx * s / b1 - 2.0 * mx * d_squares - my * d_xy;
        let at = 3u * (plane + y * width + x);
        partials[at] = d_mx * parameters.weight;
        partials[at + 1u] = d_squares * parameters.weight;
        partials[at + 2u] = d_xy * parameters.weight;
    }
    sums[thread] = s;
    for (var n = GROUP_THREADS / 2u; n > 0u; n /= 2u) {
        workgroupBarrier();
        if thread < n {
            sums[thread] += sums[thread + n];
        }
    }
    if thread == 0u {
        parts[group_of(group)] = sums[0];
    }
}

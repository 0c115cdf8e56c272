@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read> truth: array<u32>;
@group(0) @binding(2) var<storage, read> partials: array<f32>;
@group(0) @binding(3) var<storage, read_write> d_image: array<f32>;

var<workgroup> values: array<array<f32, 3>, PADDED * PADDED>;
var<workgroup> across: array<array<f32, 3>, PADDED * EDGE>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(group_of(group));
    if place.channel >= 3u {
        return;
    }
    let width = parameters.size_px[0];
    let plane = place.channel * width * parameters.size_px[1];
    for (var i = thread; i < PADDED * PADDED; i += GROUP_THREADS) {
        let pixel = pixel_of(place, i);
        var value = array<f32, 3>();
        if is_inside(pixel) {
            let at = 3u * (plane + u32(pixel.y) * width + u32(pixel.x));
            value = array(partials[at], partials[at + 1u], partials[at + 2u]);
        }
        values[i] = value;
    }
    workgroupBarrier();
    for (var i = thread; i < PADDED * EDGE; i += GROUP_THREADS) {
        let first = i / EDGE * PADDED + i % EDGE;
        var sum = vec3(0.0);
        for (var tap = 0u; tap < 11u; tap++) {
            let value = values[first + tap];
            sum += parameters.window[tap] * vec3(value[0], value[1], value[2]);
        }
        across[i] = array(sum.x, sum.y, sum.z);
    }
    workgroupBarrier();
    var by = vec3(0.0);
    for (var tap = 0u; tap < 11u; tap++) {
        let value = across[(thread / EDGE + tap) * EDGE + thread % EDGE];
        by += parameters.window[tap] * vec3(value[0], value[1], value[2]);
    }
    let x = place.x0 + thread % EDGE;
    let y = place.y0 + thread / EDGE;
    if x < width && y < parameters.size_px[1] {
        let pixel = y * width + x;
        let at = plane + pixel;
        let truth_value = f32((truth[pixel] >> (8u * place.channel)) & 255u) / 255.0;
        d_image[at] += parameters.weight * (by.x + 2.0 * image[at] * by.y + truth_value * by.z);
    }
}

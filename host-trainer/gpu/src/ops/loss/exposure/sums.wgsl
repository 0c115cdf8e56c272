// [3, height, width].
@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read> truth: array<u32>;
// [workgroups, 6].
@group(0) @binding(2) var<storage, read_write> parts: array<f32>;

struct Parameters {
    n_pixels: u32,
    foot: f32,
    white: u32,
}

var<immediate> parameters: Parameters;
var<workgroup> products: array<vec3<f32>, GROUP_THREADS>;
var<workgroup> squares: array<vec3<f32>, GROUP_THREADS>;

@compute @workgroup_size(256)
fn sums(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let n = parameters.n_pixels;
    products[thread] = vec3(0.0);
    squares[thread] = vec3(0.0);
    // 0 where the pixel does not count.
    if i < n && truth[i] >> 24u != 0u {
        let bytes = vec3(truth[i], truth[i] >> 8u, truth[i] >> 16u) & vec3(255u);
        let value = vec3(image[i], image[n + i], image[2u * n + i]) + parameters.foot;
        let counts = select(vec3(0.0), vec3(1.0), bytes < vec3(parameters.white));
        products[thread] = counts * value * (vec3<f32>(bytes) / 255.0 + parameters.foot);
        squares[thread] = counts * value * value;
    }
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            products[thread] += products[thread + width];
            squares[thread] += squares[thread + width];
        }
    }
    if thread == 0u && i < n {
        let at = 6u * group_of(group);
        for (var c = 0u; c < 3u; c++) {
            parts[at + c] = products[0][c];
            parts[at + 3u + c] = squares[0][c];
        }
    }
}

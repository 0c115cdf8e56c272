@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read> truth: array<u32>;
// [workgroups, 2].
@group(0) @binding(2) var<storage, read_write> parts: array<f32>;

var<workgroup> sums: array<vec2<f32>, GROUP_THREADS>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let n_values = 3u * parameters.n_pixels;
    var d = 0.0;
    if i < n_values {
        d = difference(image[i], truth_of(truth[i % parameters.n_pixels], i / parameters.n_pixels));
    }
    sums[thread] = vec2(abs(d), d * d);
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u && i < n_values {
        let at = 2u * group_of(group);
        parts[at] = sums[0].x;
        parts[at + 1u] = sums[0].y;
    }
}

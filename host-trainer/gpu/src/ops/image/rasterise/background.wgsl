// Shares of the background's gradient: Σ T·dL/dC of each channel over the pixels of a workgroup.

@group(0) @binding(0) var<storage, read> transmittance: array<f32>;
@group(0) @binding(1) var<storage, read> d_image: array<f32>;
// [workgroups, 3].
@group(0) @binding(2) var<storage, read_write> parts: array<f32>;

var<immediate> n_pixels: u32;
var<workgroup> sums: array<vec3<f32>, GROUP_THREADS>;

@compute @workgroup_size(256)
fn background(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    var d = vec3(0.0);
    if i < n_pixels {
        d = transmittance[i] * vec3(d_image[i], d_image[n_pixels + i], d_image[2u * n_pixels + i]);
    }
    sums[thread] = d;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    let at = 3u * group_of(group);
    if thread < 3u && i - thread < n_pixels {
        parts[at + thread] = sums[0][thread];
    }
}

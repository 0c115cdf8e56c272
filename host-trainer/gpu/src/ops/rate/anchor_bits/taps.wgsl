// A workgroup is a weight: its gradient is a sum over the sample.

@group(0) @binding(0) var<storage, read> residuals: array<f32>;
@group(0) @binding(1) var<storage, read> d_direct: array<f32>;
@group(0) @binding(2) var<storage, read_write> d_weights: array<f32>;

var<workgroup> sums: array<f32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn to_taps(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tap = group_of(group);
    var feature = 1u;
    while feature < parameters.widths[0] && first_tap_of(feature + 1u) <= tap {
        feature++;
    }
    // The feature before, as far before as the tap says.
    let before = feature - min(feature, parameters.n_taps) + tap - first_tap_of(feature);
    var sum = 0.0;
    if feature < parameters.widths[0] {
        for (var sample = thread; sample < parameters.n_sampled; sample += GROUP_THREADS) {
            let first = sample * n_channels();
            sum -= d_direct[first + feature] * residuals[first + before];
        }
    }
    sums[thread] = sum;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u && feature < parameters.widths[0] {
        d_weights[parameters.first_tap + tap] += sums[0];
    }
}

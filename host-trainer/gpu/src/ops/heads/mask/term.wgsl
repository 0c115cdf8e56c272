struct Parameters {
    n_logits: u32,
    weight: f32,
}

@group(0) @binding(0) var<storage, read> logits: array<f32>;
@group(0) @binding(1) var<storage, read_write> d_logits: array<f32>;
@group(0) @binding(2) var<storage, read_write> parts: array<f32>;

var<immediate> parameters: Parameters;
var<workgroup> sums: array<f32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn term(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    var open = 0.0;
    if i < parameters.n_logits {
        open = sigmoid_of(logits[i]);
        d_logits[i] += parameters.weight * open * (1.0 - open);
    }
    sums[thread] = open;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u && i < parameters.n_logits {
        parts[group_of(group)] = sums[0];
    }
}

// A thread is a sampled anchor: what its masks save, and its bits.

@group(0) @binding(0) var<storage, read> mask_logits: array<f32>;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read> bits: array<f32>;
@group(0) @binding(3) var<storage, read_write> d_mask_logits: array<f32>;
@group(0) @binding(4) var<storage, read_write> parts: array<f32>;

@compute @workgroup_size(256)
fn to_masks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let sample = item_of(group, thread);
    if sample >= parameters.n_sampled {
        return;
    }
    var i = sample * n_channels();
    var of_groups = vec3<f32>(0.0);
    for (var of_group = 0u; of_group < 2u; of_group++) {
        for (var channel = 0u; channel < parameters.widths[of_group]; channel++) {
            of_groups[of_group] += bits[i];
            i++;
        }
    }
    let n_offsets = parameters.widths[2] / 3u;
    let shared_weight = parameters.anchor_weight * ((of_groups[0] + of_groups[1]) / f32(n_offsets));
    for (var k = 0u; k < n_offsets; k++) {
        let of_offset = bits[i] + bits[i + 1u] + bits[i + 2u];
        i += 3u;
        of_groups[2] += of_offset;
        let at = rows[sample] * n_offsets + k;
        let open = sigmoid_of(mask_logits[at]);
        d_mask_logits[at] += (parameters.bit_weight * of_offset + shared_weight) * (open * (1.0 - open));
    }
    for (var of_group = 0u; of_group < 3u; of_group++) {
        parts[3u * sample + of_group] = of_groups[of_group];
    }
}

// clamp((W1·x + b1) >> shift) of decoder-format's context::mlp, a thread for each unit of each row.

// [n, n_in]: multiples of 2⁻²⁴ up to one, as the grid gives them.
@group(0) @binding(0) var<storage, read> inputs: array<f32>;
@group(0) @binding(1) var<storage, read> integers: array<i32>;
@group(0) @binding(2) var<storage, read> shifts: array<i32>;
// [n, n_hidden].
@group(0) @binding(3) var<storage, read_write> units: array<i32>;

const DROPPED_BITS: u32 = 10u;

@compute @workgroup_size(256)
fn hidden(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let row = i / parameters.n_hidden;
    let unit = i - row * parameters.n_hidden;
    var sum = integers[starts().x + unit];
    for (var k = 0u; k < parameters.n_in; k++) {
        let input = (i32(inputs[row * parameters.n_in + k] * 16777216.0) + 512) >> DROPPED_BITS;
        sum += integers[unit * parameters.n_in + k] * input;
    }
    units[i] = clamp(sum >> u32(shifts[unit]), 0, 32767);
}

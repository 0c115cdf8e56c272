// clamp((W2·h + b2) >> shift), in floats, a thread for each asked output of each row.

@group(0) @binding(0) var<storage, read> units: array<i32>;
@group(0) @binding(1) var<storage, read> integers: array<i32>;
@group(0) @binding(2) var<storage, read> shifts: array<i32>;
// [n, n_asked].
@group(0) @binding(3) var<storage, read_write> outputs: array<f32>;

@compute @workgroup_size(256)
fn outputs_of_units(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let row = i / parameters.n_asked;
    let output = parameters.first_output + i - row * parameters.n_asked;
    let starts = starts();
    let first = starts.y + output * parameters.n_hidden;
    var sum = integers[starts.z + output];
    for (var k = 0u; k < parameters.n_hidden; k++) {
        sum += integers[first + k] * units[row * parameters.n_hidden + k];
    }
    let limited = clamp(sum >> u32(shifts[parameters.n_hidden + output]), -32768, 32767);
    outputs[i] = f32(limited) / f32(1 << u32(output_bits(output)));
}

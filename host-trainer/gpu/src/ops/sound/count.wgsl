struct Parameters {
    n_values: u32,
    limit: f32,
    counter: u32,
}

@group(0) @binding(0) var<storage, read> values: array<u32>;
@group(0) @binding(1) var<storage, read_write> counters: array<atomic<u32>>;

var<immediate> parameters: Parameters;

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_values {
        return;
    }
    // Magnitudes ascend with their bits, infinity and NaN above all: compilers may take floats for finite.
    if (values[i] & 0x7fffffffu) > bitcast<u32>(parameters.limit) {
        atomicAdd(&counters[parameters.counter], 1u);
    }
}

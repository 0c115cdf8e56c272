struct Parameters {
    n_slots: u32,
    counter: u32,
}

@group(0) @binding(0) var<storage, read> footprints: array<Footprint>;
@group(0) @binding(1) var<storage, read_write> counters: array<atomic<u32>>;

var<immediate> parameters: Parameters;
var<workgroup> n_of_group: atomic<u32>;

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    if thread == 0u {
        atomicStore(&n_of_group, 0u);
    }
    workgroupBarrier();
    let slot = item_of(group, thread);
    if slot < parameters.n_slots && footprints[slot].depth > 0.0 {
        atomicAdd(&n_of_group, 1u);
    }
    workgroupBarrier();
    if thread == 0u {
        atomicAdd(&counters[parameters.counter], atomicLoad(&n_of_group));
    }
}

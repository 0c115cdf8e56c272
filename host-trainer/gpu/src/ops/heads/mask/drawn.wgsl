struct Parameters {
    n_anchors: u32,
    n_offsets: u32,
    threshold: f32,
}

@group(0) @binding(0) var<storage, read> logits: array<f32>;
@group(0) @binding(1) var<storage, read_write> marks: array<u32>;

var<immediate> parameters: Parameters;

@compute @workgroup_size(256)
fn drawn(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let anchor = item_of(group, thread);
    if anchor >= parameters.n_anchors {
        return;
    }
    var found = false;
    for (var k = 0u; k < parameters.n_offsets; k++) {
        found = found || logits[anchor * parameters.n_offsets + k] > parameters.threshold;
    }
    marks[anchor] = u32(found);
}

@group(0) @binding(0) var<storage, read> levels: array<u32>;
@group(0) @binding(1) var<storage, read> anchors: array<u32>;
@group(0) @binding(2) var<storage, read_write> marks: array<u32>;

@compute @workgroup_size(256)
fn mark(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = item_of(group, thread);
    if row < parameters.n_items {
        marks[row] = u32(levels[anchors[row]] == parameters.level);
    }
}

@group(0) @binding(0) var<storage, read> before: array<u32>;
@group(0) @binding(1) var<storage, read> total: array<u32>;
@group(0) @binding(2) var<storage, read_write> anchors: array<u32>;
@group(0) @binding(3) var<storage, read_write> row_of_anchor: array<u32>;

var<immediate> n_anchors: u32;

const NO_ROW: u32 = 0xffffffffu;

@compute @workgroup_size(256)
fn compact(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) n_groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let anchor = item_of(group, n_groups, thread);
    if anchor >= n_anchors {
        return;
    }
    let row = before[anchor];
    var next = total[0];
    if anchor + 1u < n_anchors {
        next = before[anchor + 1u];
    }
    if next > row {
        anchors[row] = anchor;
        row_of_anchor[anchor] = row;
    } else {
        row_of_anchor[anchor] = NO_ROW;
    }
}

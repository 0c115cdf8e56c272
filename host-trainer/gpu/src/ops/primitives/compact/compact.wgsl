// The marks are the number of marked items before each.

@group(0) @binding(0) var<storage, read> before: array<u32>;
@group(0) @binding(1) var<storage, read> total: array<u32>;
@group(0) @binding(2) var<storage, read_write> items: array<u32>;
@group(0) @binding(3) var<storage, read_write> row_of_item: array<u32>;

var<immediate> n_items: u32;

const NO_ROW: u32 = 0xffffffffu;

@compute @workgroup_size(256)
fn compact(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let item = item_of(group, thread);
    if item >= n_items {
        return;
    }
    let row = before[item];
    var next = total[0];
    if item + 1u < n_items {
        next = before[item + 1u];
    }
    if next > row {
        items[row] = item;
        row_of_item[item] = row;
    } else {
        row_of_item[item] = NO_ROW;
    }
}

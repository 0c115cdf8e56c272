@group(0) @binding(4) var<storage, read> row_of_anchor: array<u32>;

const NO_ROW: u32 = 0xffffffffu;

@compute @workgroup_size(256)
fn rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_values {
        return;
    }
    let anchor = i / parameters.width;
    let row = row_of_anchor[anchor];
    var g = 0.0;
    if row != NO_ROW {
        g = gradient[row * parameters.width + (i - anchor * parameters.width)];
    }
    update(i, g);
}

@group(0) @binding(2) var<storage, read> rows: array<f32>;
@group(0) @binding(3) var<storage, read> anchors: array<u32>;
@group(0) @binding(4) var<storage, read_write> features: array<f32>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let row = i / parameters.n_levels;
    let level = level_of(i - row * parameters.n_levels);
    let unit = unit_of(anchors[row]);
    var sums = vec4<i32>(0);
    for (var index = 0u; index < n_corners(level); index++) {
        let corner = corner_of(level, unit, index);
        let at = 4u * (level.first_row + corner.row);
        let is_positive = vec4(rows[at], rows[at + 1u], rows[at + 2u], rows[at + 3u]) >= vec4(0.0);
        let weight = i32(corner.weight);
        sums += select(vec4(-weight), vec4(weight), is_positive);
    }
    for (var f = 0u; f < 4u; f++) {
        // Exact: no more than 2²⁴.
        features[4u * i + f] = f32(sums[f]) * (1.0 / 16777216.0);
    }
}

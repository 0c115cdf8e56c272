@group(0) @binding(2) var<storage, read> rows: array<f32>;
@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> entries: array<u32>;
@group(0) @binding(5) var<storage, read> row_of_anchor: array<u32>;
@group(0) @binding(6) var<storage, read> d_features: array<f32>;
@group(0) @binding(7) var<storage, read_write> d_rows: array<f32>;

const NO_ROW: u32 = 0xffffffffu;

@compute @workgroup_size(256)
fn backward(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) n_groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let grid_row = item_of(group, n_groups, thread);
    if grid_row >= parameters.n_items {
        return;
    }
    var index = 0u;
    var level = level_of(0u);
    while index + 1u < parameters.n_levels && grid_row >= level.first_row + level.n_rows {
        index++;
        level = level_of(index);
    }
    var sums = vec4<f32>(0.0);
    for (var entry = starts[grid_row]; entry < starts[grid_row + 1u]; entry++) {
        let anchor = entries[entry] >> 3u;
        let row = row_of_anchor[anchor];
        if row == NO_ROW {
            continue;
        }
        let weight = corner_of(level, unit_of(anchor), entries[entry] & 7u).weight;
        let at = 4u * (row * parameters.n_levels + index);
        let d = vec4(d_features[at], d_features[at + 1u], d_features[at + 2u], d_features[at + 3u]);
        sums += f32(weight) * (1.0 / 16777216.0) * d;
    }
    for (var f = 0u; f < 4u; f++) {
        let passes = abs(rows[4u * grid_row + f]) <= 1.0;
        d_rows[4u * grid_row + f] = select(0.0, sums[f], passes);
    }
}

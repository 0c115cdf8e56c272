@group(0) @binding(2) var<storage, read> rows: array<f32>;
@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> entries: array<u32>;
@group(0) @binding(5) var<storage, read> row_of_anchor: array<u32>;
@group(0) @binding(6) var<storage, read> d_features: array<f32>;
@group(0) @binding(7) var<storage, read_write> d_rows: array<f32>;

const NO_ROW: u32 = 0xffffffffu;

// Nodes of a coarse level have thousands of anchors each.
const THREADS_PER_ROW: u32 = 32u;
const ROWS_PER_GROUP: u32 = GROUP_THREADS / THREADS_PER_ROW;

var<workgroup> parts: array<vec4<f32>, GROUP_THREADS>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let grid_row = group_of(group) * ROWS_PER_GROUP + thread / THREADS_PER_ROW;
    let part = thread % THREADS_PER_ROW;
    var sum = vec4<f32>(0.0);
    if grid_row < parameters.n_items {
        sum = sum_of_part(grid_row, part);
    }
    parts[thread] = sum;
    for (var half = THREADS_PER_ROW / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if part < half {
            parts[thread] += parts[thread + half];
        }
    }
    if part > 0u || grid_row >= parameters.n_items {
        return;
    }
    for (var f = 0u; f < 4u; f++) {
        let passes = abs(rows[4u * grid_row + f]) <= 1.0;
        d_rows[4u * grid_row + f] = select(0.0, parts[thread][f], passes);
    }
}

// Every THREADS_PER_ROW-th entry of a row.
fn sum_of_part(grid_row: u32, part: u32) -> vec4<f32> {
    var index = 0u;
    var level = level_of(0u);
    while index + 1u < parameters.n_levels && grid_row >= level.first_row + level.n_rows {
        index++;
        level = level_of(index);
    }
    var sum = vec4<f32>(0.0);
    for (var entry = starts[grid_row] + part; entry < starts[grid_row + 1u]; entry += THREADS_PER_ROW) {
        let anchor = entries[entry] >> 3u;
        let row = row_of_anchor[anchor];
        if row == NO_ROW {
            continue;
        }
        let weight = corner_of(level, unit_of(anchor), entries[entry] & 7u).weight;
        let at = 4u * (row * parameters.n_levels + index);
        let d = vec4(d_features[at], d_features[at + 1u], d_features[at + 2u], d_features[at + 3u]);
        sum += f32(weight) * (1.0 / 16777216.0) * d;
    }
    return sum;
}

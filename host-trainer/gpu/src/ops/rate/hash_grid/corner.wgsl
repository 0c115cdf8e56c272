// The nodes around a place, as decoder-format's context::grid has them.

struct Parameters {
    // (anchor, level), or rows.
    n_items: u32,
    n_levels: u32,
}

@group(0) @binding(0) var<storage, read> levels: array<u32>;
@group(0) @binding(1) var<storage, read> units: array<u32>;

var<immediate> parameters: Parameters;

struct GridLevel {
    // 0: all axes; 1: x and y; 2: x and z; 3: y and z.
    kind: u32,
    resolution: u32,
    n_rows: u32,
    first_row: u32,
    is_dense: bool,
}

struct Corner {
    // Of the level's table.
    row: u32,
    // In parts of 2²⁴.
    weight: u32,
}

fn level_of(index: u32) -> GridLevel {
    let at = 5u * index;
    return GridLevel(levels[at], levels[at + 1u], levels[at + 2u], levels[at + 3u], levels[at + 4u] != 0u);
}

fn unit_of(anchor: u32) -> vec3<u32> {
    let packed = units[2u * anchor];
    return vec3(packed & 0xffffu, packed >> 16u, units[2u * anchor + 1u]);
}

fn corner_of(level: GridLevel, unit: vec3<u32>, index: u32) -> Corner {
    // Of a plane, its two axes and one that does not count.
    var along = unit;
    if level.kind == 1u {
        along.z = 0u;
    } else if level.kind == 2u {
        along = vec3(unit.x, unit.z, 0u);
    } else if level.kind == 3u {
        along = vec3(unit.y, unit.z, 0u);
    }
    let place = along * (level.resolution - 1u);
    let is_upper = vec3(index & 1u, (index >> 1u) & 1u, index >> 2u);
    let upper_weight = (place >> vec3(8u)) & vec3(0xffu);
    let node = (place >> vec3(16u)) + is_upper;
    let weight = select(256u - upper_weight, upper_weight, is_upper == vec3(1u));
    var row = (node.z * level.resolution + node.y) * level.resolution + node.x;
    if !level.is_dense {
        row = (node.x ^ (node.y * 2654435761u) ^ (node.z * 805459861u)) & (level.n_rows - 1u);
    }
    return Corner(row, weight.x * weight.y * weight.z);
}

fn n_corners(level: GridLevel) -> u32 {
    return select(4u, 8u, level.kind == 0u);
}

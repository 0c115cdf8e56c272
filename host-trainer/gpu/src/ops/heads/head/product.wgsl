// A tile of a product: 64×16 sums, four a thread. The kernel says what its factors are: left_of(row, depth), right_of(depth, column), 0
// where there is none.

const TILE_ROWS: u32 = 64u;
const TILE_COLUMNS: u32 = 16u;
const TILE_DEPTH: u32 = 16u;

// One value of padding a row: the threads of a row of the tile write one below the other.
var<workgroup> left: array<f32, 1040>;
var<workgroup> right: array<f32, 256>;

struct Tile {
    first_row: u32,
    column: u32,
    // After the tiles of the product: a part of the depth.
    part: u32,
}

fn n_row_tiles() -> u32 {
    return (parameters.n_rows + TILE_ROWS - 1u) / TILE_ROWS;
}

fn n_column_tiles() -> u32 {
    return (parameters.n_columns + TILE_COLUMNS - 1u) / TILE_COLUMNS;
}

// The sums of thread t are rows first_row + 16·i of a column.
fn tile_of(group: u32, thread: u32) -> Tile {
    let of_part = n_row_tiles() * n_column_tiles();
    let part = group / of_part;
    let tile = group - part * of_part;
    let row_tile = tile / n_column_tiles();
    let column_tile = tile - row_tile * n_column_tiles();
    return Tile(row_tile * TILE_ROWS + thread / 16u, column_tile * TILE_COLUMNS + thread % 16u, part);
}

fn product(tile: Tile, thread: u32, begin: u32, end: u32) -> vec4<f32> {
    let row = thread / 16u;
    let column = thread % 16u;
    let first_row = tile.first_row - row;
    var sums = vec4<f32>(0.0);
    for (var start = begin; start < end; start += TILE_DEPTH) {
        // Nobody still reads the tiles before.
        workgroupBarrier();
        for (var i = 0u; i < 4u; i++) {
            let of_tile = row + 16u * i;
            var value = 0.0;
            if start + column < end && first_row + of_tile < parameters.n_rows {
                value = left_of(first_row + of_tile, start + column);
            }
            left[column * 65u + of_tile] = value;
        }
        var value = 0.0;
        if start + row < end && tile.column < parameters.n_columns {
            value = right_of(start + row, tile.column);
        }
        right[thread] = value;
        workgroupBarrier();
        for (var d = 0u; d < TILE_DEPTH; d++) {
            let at = d * 65u + row;
            sums += vec4(left[at], left[at + 16u], left[at + 32u], left[at + 48u]) * right[d * 16u + column];
        }
    }
    return sums;
}

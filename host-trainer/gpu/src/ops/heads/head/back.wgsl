// The factors of a layer's backward: d_above·W, what comes back through its weights.

@group(0) @binding(0) var<storage, read> d_above: array<f32>;
@group(0) @binding(1) var<storage, read> weights: array<f32>;

fn left_of(row: u32, depth: u32) -> f32 {
    return d_above[row * parameters.depth + depth];
}

fn right_of(depth: u32, column: u32) -> f32 {
    return weights[parameters.first_weight + depth * parameters.n_columns + column];
}

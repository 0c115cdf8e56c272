struct Parameters {
    n_rows: u32,
    n_columns: u32,
    depth: u32,
    input_stride: u32,
    first_weight: u32,
    first_bias: u32,
    is_rectified: u32,
    part_rows: u32,
    n_parts: u32,
}

var<immediate> parameters: Parameters;

// The streams of ops/rate/noise.rs, bit for bit.

fn mix_bits(x: u32) -> u32 {
    let y = (x ^ (x >> 16u)) * 0x7feb352du;
    let z = (y ^ (y >> 15u)) * 0x846ca68bu;
    return z ^ (z >> 16u);
}

fn branch_of(stream: u32, index: u32) -> u32 {
    return mix_bits(stream ^ mix_bits(index * 0x9e3779b9u + 0x85ebca6bu));
}

// The number of a stream: a whole number of 2⁻²⁴.
fn draw_of(stream: u32, index: u32) -> u32 {
    return mix_bits(stream + index * 0x9e3779b9u) >> 8u;
}

fn uniform_of(stream: u32, index: u32) -> f32 {
    return f32(draw_of(stream, index)) * (1.0 / 16777216.0);
}

// A network in floats and in integers: W1 [n_hidden, n_in], b1, W2 [n_out, n_hidden], b2, then taps in floats alone.

const INPUT_BITS: i32 = 14;
const HIDDEN_BITS: i32 = 10;
const MEAN_BITS: i32 = 6;
const EIGHTH_BITS: i32 = 3;

struct Parameters {
    // Rows of weights and taps, or values.
    n_items: u32,
    n_in: u32,
    n_hidden: u32,
    // Of the network.
    n_out: u32,
    // Means come first, in parts of 2^MEAN_BITS; all others are in parts of 2^EIGHTH_BITS.
    n_means: u32,
    // The first output that is asked for, and how many are.
    first_output: u32,
    n_asked: u32,
}

var<immediate> parameters: Parameters;

// Where b1, W2, b2 and the taps start.
fn starts() -> vec4<u32> {
    let b1 = parameters.n_hidden * parameters.n_in;
    let w2 = b1 + parameters.n_hidden;
    let b2 = w2 + parameters.n_out * parameters.n_hidden;
    return vec4(b1, w2, b2, b2 + parameters.n_out);
}

fn output_bits(output: u32) -> i32 {
    return select(EIGHTH_BITS, MEAN_BITS, output < parameters.n_means);
}

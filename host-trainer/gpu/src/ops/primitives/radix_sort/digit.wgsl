// Which digit of a key a pass sorts by. A thread has PER_THREAD pairs that stand side by side.

const PER_THREAD: u32 = 8u;
const N_DIGITS: u32 = 16u;

struct Parameters {
    n_pairs: u32,
    n_blocks: u32,
    shift: u32,
}

var<immediate> parameters: Parameters;

fn digit_of(key: u32) -> u32 {
    return (key >> parameters.shift) & (N_DIGITS - 1u);
}

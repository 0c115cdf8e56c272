// Functions whose precision WGSL leaves to the adapter, as real.rs and decoder-format have them.

const LN_2: f32 = 0.6931471805599453;

// e^x; arguments are clamped to -87..88. x = n·ln 2 + r, the polynomial of decoder_core::math::exp.
fn exp_of(argument: f32) -> f32 {
    let x = clamp(argument, -87.0, 88.0);
    let n = round(x * 1.4426950408889634);
    let r = (x - n * 0.693359375) + n * 2.1219444e-4;
    let square = r * r;
    let tail = ((0.0013926927 * r + 0.008363774) * r + 0.04166655) * r + 0.16666573;
    let e = (tail * r + 0.5) * square + r + 1.0;
    return e * bitcast<f32>(u32(i32(n) + 127) << 23u);
}

// log2 of a positive, normal number, the series of real.rs.
fn log2_of(x: f32) -> f32 {
    let shifted = bitcast<u32>(x) - 0x3f3504f3u;
    let n = f32(bitcast<i32>(shifted) >> 23u);
    let m = bitcast<f32>((shifted & 0x007fffffu) + 0x3f3504f3u);
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    return n + s * ((((0.3205989 * square + 0.4121986) * square + 0.57707804) * square + 0.9617967) * square + 2.88539);
}

fn ln_of(x: f32) -> f32 {
    return log2_of(x) * LN_2;
}

fn sigmoid_of(x: f32) -> f32 {
    return 1.0 / (1.0 + exp_of(-x));
}

fn tanh_of(x: f32) -> f32 {
    let square = x * x;
    if square < 1e-4 {
        return x * (1.0 - square * (1.0 / 3.0 - square * (2.0 / 15.0 - square * (17.0 / 315.0))));
    }
    return 2.0 * sigmoid_of(2.0 * x) - 1.0;
}

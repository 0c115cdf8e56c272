// A channel of a sampled anchor: features, then log-scales, then offsets.

struct Parameters {
    base_steps: array<f32, 3>,
    exponents: array<f32, 2>,
    log2_scales: array<f32, 2>,
    bit_weight: f32,
    anchor_weight: f32,
    mask_threshold: f32,
    n_sampled: u32,
    widths: array<u32, 3>,
    n_taps: u32,
    first_tap: u32,
}

var<immediate> parameters: Parameters;

struct Channel {
    sample: u32,
    // Of all channels.
    index: u32,
    // Features, log-scales, offsets.
    group: u32,
    // Of the group.
    of_group: u32,
}

fn n_channels() -> u32 {
    return parameters.widths[0] + parameters.widths[1] + parameters.widths[2];
}

fn channel_of(item: u32) -> Channel {
    let sample = item / n_channels();
    let index = item - sample * n_channels();
    let first_offset = parameters.widths[0] + parameters.widths[1];
    if index < parameters.widths[0] {
        return Channel(sample, index, 0u, index);
    }
    if index < first_offset {
        return Channel(sample, index, 1u, index - parameters.widths[0]);
    }
    return Channel(sample, index, 2u, index - first_offset);
}

// Where the outputs of a sampled anchor start: C means, C log₂ scales, 3 exponents.
fn first_output(sample: u32) -> u32 {
    return sample * (2u * n_channels() + 3u);
}

fn clamped_exponent(exponent: f32) -> f32 {
    return clamp(exponent, parameters.exponents[0], parameters.exponents[1]);
}

// 2^−e.
fn per_base(exponent: f32) -> f32 {
    return exp_of(-(exponent * LN_2));
}

// The gradient that passes back through a clamp: outside only what leads back in.
fn clamp_backward(value: f32, range: array<f32, 2>, gradient: f32) -> f32 {
    let leads_out = (value > range[1] && gradient < 0.0) || (value < range[0] && gradient > 0.0);
    return select(gradient, 0.0, leads_out);
}

// Weights of the taps before those of a feature.
fn first_tap_of(feature: u32) -> u32 {
    let short = min(feature, parameters.n_taps);
    // Of no feature there are none; the product is even.
    return short * (max(short, 1u) - 1u) / 2u + (feature - short) * parameters.n_taps;
}

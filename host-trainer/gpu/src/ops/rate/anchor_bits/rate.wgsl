// ops/rate/normal_bits.rs and ops/rate/normal.rs.

struct Bits {
    bits: f32,
    d_value: f32,
    d_log2_scale: f32,
}

const PROBABILITY_FLOOR: f32 = 1e-6;
const LOG2_E: f32 = 1.4426950408889634;

// φ(x) and Q(x), x ≥ 0; above 8 those of 8.
fn density_and_tail(argument: f32) -> vec2<f32> {
    let x = min(argument, 8.0);
    let density = 0.3989422804014327 * exp_of(-0.5 * (x * x));
    let t = 1.0 / (1.0 + 0.3125 * x);
    var mills = -0.0635097123655;
    mills = mills * t + 0.414391417802;
    mills = mills * t - 1.0623128701;
    mills = mills * t + 1.25741159283;
    mills = mills * t - 0.719861139963;
    mills = mills * t + 0.622898970534;
    mills = mills * t + 0.157230031243;
    mills = mills * t + 0.337275587642;
    mills = mills * t + 0.309645016188;
    mills = mills * t + 0.000145243023713;
    return vec2(density, density * mills);
}

// Of a value that lies so far from its mean, in steps.
fn bits_of(signed_distance: f32, log2_scale: f32) -> Bits {
    let inverse_scale = exp_of(-(log2_scale * LN_2));
    let distance = abs(signed_distance);
    let a = (distance - 0.5) * inverse_scale;
    let b = (distance + 0.5) * inverse_scale;
    let at_a = density_and_tail(abs(a));
    let at_b = density_and_tail(b);
    let above_a = select(at_a.y, 1.0 - at_a.y, a < 0.0);
    let probability = above_a - at_b.y;
    let lifted = max(probability, PROBABILITY_FLOOR);
    var found = Bits(-log2_of(lifted), 0.0, 0.0);
    if probability > PROBABILITY_FLOOR {
        let slope = -(LOG2_E / lifted);
        let d_distance = slope * (at_b.x - at_a.x) * inverse_scale;
        found.d_value = select(d_distance, -d_distance, signed_distance < 0.0);
        found.d_log2_scale = slope * LN_2 * (a * at_a.x - b * at_b.x);
    }
    return found;
}

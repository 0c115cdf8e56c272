//! Colours painted on the surfaces: patterns whose finest detail is a few pixels of a 128 px image.

use glam::DVec3;

/// A pattern over a surface's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) enum Texture {
    /// Checks of two sizes, flecked with noise: a tiled floor.
    Tiles,
    /// Slanted stripes on painted faces, each face its own colour.
    Stripes,
    /// Dots over broad bands.
    Dots,
    /// One colour.
    Plain(DVec3),
}

impl Texture {
    /// The colour at `local`, a point in the surface's own frame, each channel in [0, 1].
    pub(super) fn colour(self, local: DVec3, seed: u64) -> DVec3 {
        match self {
            Self::Tiles => {
                let large = checks(local, 0.36);
                let base = mix(DVec3::new(0.78, 0.70, 0.55), DVec3::new(0.36, 0.46, 0.54), large);
                let fine = checks(local + DVec3::splat(0.02), 0.09);
                let flecks = noise(local * 11.0, seed);
                base * (0.72 + 0.23 * fine) * (0.72 + 0.56 * flecks)
            }
            Self::Stripes => {
                // The face is told by the largest coordinate, the box being nearly a cube.
                let axis = local.abs().to_array();
                let (face, u, v) = if axis[2] > axis[0].max(axis[1]) {
                    (DVec3::new(0.85, 0.35, 0.25), local.x, local.y)
                } else if axis[0] > axis[1] {
                    (DVec3::new(0.30, 0.65, 0.35), local.y, local.z)
                } else {
                    (DVec3::new(0.85, 0.70, 0.25), local.x, local.z)
                };
                let stripe = square_wave((u + 0.5 * v) / 0.42);
                let broad = noise(local * 4.0, seed ^ 1);
                mix(face, DVec3::splat(0.85) - 0.45 * face, stripe) * (0.7 + 0.5 * broad)
            }
            Self::Dots => {
                let band = square_wave(local.z * 2.2);
                let base = mix(DVec3::new(0.25, 0.35, 0.65), DVec3::new(0.60, 0.30, 0.40), band);
                // Longitude by latitude, so that the dots stay on the surface's grid.
                let (u, v) = (local.y.atan2(local.x) * 12.0 / std::f64::consts::TAU, local.z * 3.8);
                let offset = DVec3::new(u - u.floor() - 0.5, v - v.floor() - 0.5, 0.0);
                if offset.length() < 0.27 { DVec3::new(0.78, 0.74, 0.62) } else { base }
            }
            Self::Plain(colour) => colour,
        }
    }
}

fn mix(a: DVec3, b: DVec3, weight: f64) -> DVec3 {
    a + (b - a) * weight
}

/// 0 and 1 in turn, one period per unit.
fn square_wave(x: f64) -> f64 {
    if x.rem_euclid(1.0) < 0.5 { 0.0 } else { 1.0 }
}

/// Checks of side `side` in x and y, 0 and 1.
fn checks(p: DVec3, side: f64) -> f64 {
    (square_wave(0.5 * p.x / side) - square_wave(0.5 * p.y / side)).abs()
}

/// Smooth noise in [0, 1]: random values at whole coordinates, blended between them.
fn noise(p: DVec3, seed: u64) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let w = f * f * (DVec3::splat(3.0) - 2.0 * f);
    let mut sum = 0.0;
    for corner in 0..8_u8 {
        let pick = |bit: u8| f64::from(corner >> bit & 1);
        let offset = DVec3::new(pick(0), pick(1), pick(2));
        let blend = (DVec3::ONE - offset) + (2.0 * offset - DVec3::ONE) * w;
        let at = cell + offset;
        #[expect(clippy::cast_possible_truncation, reason = "the scene is a few units wide")]
        let value = unit_hash(at.x as i64, at.y as i64, at.z as i64, seed);
        sum += value * blend.x * blend.y * blend.z;
    }
    sum
}

/// A number in [0, 1) that depends on all its arguments and on nothing else (the mixer of SplitMix64, Steele 2014).
pub(super) fn unit_hash(x: i64, y: i64, z: i64, seed: u64) -> f64 {
    let mut state = seed;
    for coordinate in [x, y, z] {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15) ^ coordinate.cast_unsigned();
        state = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state = (state ^ state >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        state ^= state >> 31;
    }
    (state >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_bounded_continuous_and_seeded() {
        let mut previous = noise(DVec3::ZERO, 3);
        for i in 1..4000 {
            let p = DVec3::new(f64::from(i) * 1e-3, f64::from(i) * 7e-4, -f64::from(i) * 3e-4);
            let value = noise(p, 3);
            assert!((0.0..=1.0).contains(&value), "{value}");
            // The blend's slope is at most 1.5 per unit and axis.
            assert!((value - previous).abs() < 4e-3, "a jump at {p}");
            previous = value;
        }
        assert_ne!(noise(DVec3::splat(0.4), 3), noise(DVec3::splat(0.4), 4));
    }

    #[test]
    fn textures_stay_near_the_range_of_colours() {
        for i in 0..1000 {
            let p = DVec3::new(unit_hash(i, 0, 0, 1), unit_hash(i, 1, 0, 1), unit_hash(i, 2, 0, 1)) * 2.0 - DVec3::ONE;
            for texture in [Texture::Tiles, Texture::Stripes, Texture::Dots] {
                let colour = texture.colour(p, 9);
                assert!(colour.min_element() >= 0.0 && colour.max_element() <= 1.2, "{texture:?} {colour}");
            }
        }
    }
}

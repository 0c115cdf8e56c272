//! The order of a Morton curve through the scene.

/// Indices of the centres along the curve: x, y and z in 10 bits each between their least and largest, interleaved.
pub(crate) fn order(centres: &[[f32; 3]]) -> Vec<usize> {
    let (mut least, mut largest) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for centre in centres {
        for axis in 0..3 {
            least[axis] = least[axis].min(centre[axis]);
            largest[axis] = largest[axis].max(centre[axis]);
        }
    }
    let code = |centre: &[f32; 3]| {
        (0..3).fold(0u32, |code, axis| {
            let range = f64::from(largest[axis]) - f64::from(least[axis]);
            let share = if range > 0.0 { (f64::from(centre[axis]) - f64::from(least[axis])) / range } else { 0.0 };
            code | spread((share * 1023.0) as u32) << axis
        })
    };
    let mut order: Vec<(u32, usize)> =
        centres.iter().enumerate().map(|(index, centre)| (code(centre), index)).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, index)| index).collect()
}

/// Puts two zeros between each of the low ten bits.
fn spread(bits: u32) -> u32 {
    (0..10).fold(0, |spread, bit| spread | (bits >> bit & 1) << (3 * bit))
}

#[cfg(test)]
mod tests {
    use super::{order, spread};

    #[test]
    fn the_curve_goes_through_octants() {
        assert_eq!(spread(0b1011), 0b001_000_001_001);
        let corners: Vec<[f32; 3]> = (0..8u8).map(|n| [n & 1, n >> 1 & 1, n >> 2].map(f32::from)).rev().collect();
        assert_eq!(order(&corners), [7, 6, 5, 4, 3, 2, 1, 0]);
    }
}

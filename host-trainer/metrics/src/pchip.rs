//! A curve through points that rises wherever they do.

/// Piecewise cubic through points of rising abscissae, with the slopes of Fritsch and Butland ("A method for constructing
/// local monotone piecewise cubic interpolants", 1984): between two points it neither overshoots nor turns.
#[derive(Clone, Debug)]
pub(super) struct Pchip {
    x: Vec<f64>,
    y: Vec<f64>,
    /// dy/dx at the points.
    slope: Vec<f64>,
}

impl Pchip {
    /// # Panics
    /// With fewer than two points, or abscissae that do not rise.
    pub(super) fn new(points: &[(f64, f64)]) -> Self {
        assert!(points.len() >= 2, "a curve needs two points, not {}", points.len());
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let width: Vec<f64> = x.windows(2).map(|x| x[1] - x[0]).collect();
        assert!(width.iter().all(|&width| width > 0.0), "abscissae must rise");
        let rise: Vec<f64> = y.windows(2).zip(&width).map(|(y, width)| (y[1] - y[0]) / width).collect();
        let last = rise.len() - 1;
        let slope = (0..x.len())
            .map(|i| match i {
                _ if last == 0 => rise[0],
                0 => end_slope([width[0], width[1]], [rise[0], rise[1]]),
                _ if i > last => end_slope([width[last], width[last - 1]], [rise[last], rise[last - 1]]),
                _ if rise[i - 1] * rise[i] <= 0.0 => 0.0,
                _ => {
                    let (w0, w1) = (2.0 * width[i] + width[i - 1], width[i] + 2.0 * width[i - 1]);
                    (w0 + w1) / (w0 / rise[i - 1] + w1 / rise[i])
                }
            })
            .collect();
        Self { x, y, slope }
    }

    /// The value at `x`, which lies between the first and the last point.
    fn at(&self, x: f64) -> f64 {
        let i = self.x.partition_point(|&start| start <= x).clamp(1, self.x.len() - 1) - 1;
        let width = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / width;
        let (rest, start, end) = (1.0 - t, (self.y[i], self.slope[i]), (self.y[i + 1], self.slope[i + 1]));
        // Hermite's basis.
        start.0 * rest * rest * (1.0 + 2.0 * t)
            + end.0 * t * t * (3.0 - 2.0 * t)
            + width * t * rest * (start.1 * rest - end.1 * t)
    }

    /// The integral over `from..to`, within the points; exact, because Simpson's rule is for cubics.
    pub(super) fn integral(&self, from: f64, to: f64) -> f64 {
        let inner = self.x.iter().copied().filter(|&x| from < x && x < to);
        let cuts: Vec<f64> = std::iter::once(from).chain(inner).chain([to]).collect();
        cuts.windows(2)
            .map(|cut| {
                let middle = self.at(0.5 * (cut[0] + cut[1]));
                (cut[1] - cut[0]) / 6.0 * (self.at(cut[0]) + 4.0 * middle + self.at(cut[1]))
            })
            .sum()
    }
}

/// The slope at an end from the parabola through three points, bounded so that the curve does not turn.
///
/// * `width`, `rise`: of the piece at the end, and of the next.
fn end_slope(width: [f64; 2], rise: [f64; 2]) -> f64 {
    let slope = ((2.0 * width[0] + width[1]) * rise[0] - width[0] * rise[1]) / (width[0] + width[1]);
    if slope * rise[0] <= 0.0 {
        0.0
    } else if rise[0] * rise[1] <= 0.0 && slope.abs() > 3.0 * rise[0].abs() {
        3.0 * rise[0]
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uneven_points_give_the_values_of_another_implementation() {
        // SciPy 1.17, `PchipInterpolator`.
        let curve = Pchip::new(&[(0.0, 0.0), (1.0, 1.0), (3.0, 1.5), (4.0, 1.5)]);
        for (x, y) in [(0.5, 0.602_678_571), (2.0, 1.357_142_857), (3.5, 1.5), (0.0, 0.0), (4.0, 1.5)] {
            assert!((curve.at(x) - y).abs() < 1e-9, "at {x}: {}, not {y}", curve.at(x));
        }
        assert!((curve.integral(0.25, 3.75) - 4.297_188_895).abs() < 1e-9, "{}", curve.integral(0.25, 3.75));
    }

    #[test]
    fn a_curve_through_rising_points_never_falls() {
        let curve = Pchip::new(&[(0.0, 0.0), (0.1, 5.0), (2.0, 5.1), (2.1, 5.1), (3.0, 20.0)]);
        let values: Vec<f64> = (0..=300).map(|i| curve.at(f64::from(i) / 100.0)).collect();
        assert!(values.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12), "{values:?}");
    }

    #[test]
    fn two_points_make_a_line() {
        let curve = Pchip::new(&[(1.0, 2.0), (3.0, 6.0)]);
        assert!((curve.at(1.5) - 3.0).abs() < 1e-12);
        assert!((curve.integral(1.0, 3.0) - 8.0).abs() < 1e-12);
    }
}

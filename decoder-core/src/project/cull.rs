//! What a view can see: boxes of chunks, then anchors.

use pocketsplat_format::bundle::Chunk;
use pocketsplat_format::rules::NEAR;
use pocketsplat_format::{Bundle, Camera, DecodeError};

use super::covariance::Covariance;
use super::view::View;

/// The chunks of the first `tiers` tiers that a frame of `camera` needs: those whose ink box it can see, in file order.
///
/// # Errors
/// [`DecodeError::BadFloat`] or [`DecodeError::OutOfRange`] for an unusable camera.
///
/// # Budget
/// About 100 multiplications a chunk; reads the directory and no chunk.
pub fn chunks_in_view<'b>(
    bundle: &Bundle<'b>,
    camera: &Camera,
    tiers: u8,
) -> Result<impl Iterator<Item = Chunk<'b>> + use<'b>, DecodeError> {
    let view = View::of(bundle.header(), camera)?;
    let n_chunks = bundle.up_to_tier(tiers).n_chunks;
    Ok(bundle.chunks().take(n_chunks as usize).filter(move |chunk| view.sees_box(chunk.ink_box())))
}

impl View {
    /// Whether anything inside a box can reach the image; true more often than needed, never false wrongly.
    ///
    /// The box holds, for each of its splats, a sphere of radius r = √(2 ln 255)·σ_max around the centre (x, y, z). On
    /// the image the splat reaches at most r·fx/z·√(1 + t²) from its centre, t being the clamped slope, plus the reach
    /// of the dilation. So it ends left of the image when x + m·z + r·√(1 + t²) < 0 for m = (cx + reach)/fx, and if m
    /// is taken no smaller than |t| can be, that follows from the whole sphere lying beyond the plane x + m·z = 0.
    pub(crate) fn sees_box(&self, (min, max): ([f32; 3], [f32; 3])) -> bool {
        let [row_x, row_y, row_z] = self.rotation;
        let [tx, ty, tz] = self.translation;
        // The largest value of normal·p + shift over the box.
        let reach = |normal: [f32; 3], shift: f32| {
            let corners = normal.iter().zip(min.iter().zip(&max));
            let farthest: f32 = corners.map(|(&n, (&low, &high))| n * if n > 0.0 { high } else { low }).sum();
            let size: f32 =
                normal.iter().zip(min.iter().zip(&max)).map(|(n, (a, b))| n.abs() * (a.abs() + b.abs())).sum();
            // The sums above are rounded; a part in 10⁵ of their terms is well beyond that.
            farthest + shift + 1e-5 * (size + shift.abs())
        };
        // NaN, from absurd cameras, counts as seen here and below.
        if reach(row_z, tz) <= NEAR {
            return false;
        }
        let sides = self.sides();
        sides.into_iter().all(|(axis_x, sign, slope)| {
            let (row, shift) = if axis_x { (row_x, tx) } else { (row_y, ty) };
            let [a0, a1, a2] = row.map(|r| r * sign);
            let [z0, z1, z2] = row_z.map(|r| r * slope);
            let beyond = reach([a0 + z0, a1 + z1, a2 + z2], shift * sign + tz * slope) < 0.0;
            !beyond
        })
    }

    /// Left, right, top, bottom: which axis, its sign, and the slope m of the plane `sign·x + m·z = 0`.
    fn sides(&self) -> [(bool, f32, f32); 4] {
        let [fx, fy] = self.focal_px;
        let [cx, cy] = self.principal_px;
        let [width, height] = self.size_px;
        let [min_x, min_y] = self.slope_min;
        let [max_x, max_y] = self.slope_max;
        let reach_px = self.dilation.reach_px;
        let steepest = |from: f32, limit: f32, other: f32| {
            // The slope of a splat beyond this side lies between the image's edge and the clamp.
            let clamp = if limit.abs() > other.abs() { limit.abs() } else { other.abs() };
            if from > clamp { from } else { clamp }
        };
        [
            (true, 1.0, steepest((cx + reach_px) / fx, min_x, max_x)),
            (true, -1.0, steepest((width - cx + reach_px) / fx, max_x, min_x)),
            (false, 1.0, steepest((cy + reach_px) / fy, min_y, max_y)),
            (false, -1.0, steepest((height - cy + reach_px) / fy, max_y, min_y)),
        ]
    }

    /// The prefilter of anchors: an anchor counts as a Gaussian with deviations `extent` along the world's axes, and is
    /// kept when the square of ⌈3·√λ_max⌉ pixels around its centre overlaps the image.
    pub(crate) fn sees_anchor(&self, position: [f32; 3], extent: [f32; 3]) -> bool {
        let point = self.to_camera(position);
        let [_, _, z] = point;
        let in_front = z > NEAR;
        if !in_front {
            return false;
        }
        let [u, v] = self.to_image(point);
        let [width, height] = self.size_px;
        let [l0, l1, l2] = extent;
        // Whatever its size. Of sums that overflow the test below makes something else.
        if u > 0.0 && u < width && v > 0.0 && v < height && l0 + l1 + l2 < 1e9 {
            return true;
        }
        let rows = self.jacobian(point).map(|[a, b, c]| [a * l0, b * l1, c * l2]);
        let covariance = Covariance::from_rows(rows, self.dilation);
        let half_difference = 0.5 * (covariance.xx - covariance.yy);
        // mid² − det, written without the difference of two large numbers.
        let spread = half_difference * half_difference + covariance.xy * covariance.xy;
        let spread = if spread > 0.1 { spread } else { 0.1 };
        let lambda_max = 0.5 * (covariance.xx + covariance.yy) + pocketsplat_half::sqrt(spread);
        let radius = libm::ceilf(3.0 * pocketsplat_half::sqrt(lambda_max));
        u + radius > 0.0 && u - radius < width && v + radius > 0.0 && v - radius < height
    }
}

#[cfg(test)]
mod tests {
    use super::View;
    use crate::functions::Reference;
    use crate::project::dilation::Dilation;
    use crate::scene::Gaussian;
    use pocketsplat_format::bundle::Effects;
    use pocketsplat_format::{Camera, Rotation};

    /// Far from the origin the sums of the test and those of the projection are rounded by more than a pixel, each by its own.
    #[test]
    fn what_rounding_moves_into_the_image_far_from_the_origin_is_seen() {
        let mut state = 5_u32;
        let mut between = |low: f32, high: f32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            low + (high - low) * (state >> 8) as f32 / 16_777_216.0
        };
        let [mut n_drawn, mut n_left_out] = [0; 2];
        for _ in 0..20_000 {
            let [(s, c), (sz, cz)] = [between(-0.7, 0.7), between(-3.0, 3.0)].map(f32::sin_cos);
            let rotation = [cz, -sz, 0.0, c * sz, c * cz, -s, s * sz, s * cz, c];
            let far = 10.0_f32.powf(between(0.0, 7.0));
            let centre = [(); 3].map(|()| between(-far, far));
            // Around the left border of the image, and around the line that a splat is surely beyond.
            let depth = between(0.3, 3.0);
            let point = [(between(-24.0, 2.0) - 40.0) / 80.0 * depth, between(-0.3, 0.3) * depth, depth];
            let translation = std::array::from_fn(|row| {
                let turned: f64 = (0..3).map(|i| f64::from(rotation[3 * row + i]) * f64::from(centre[i])).sum();
                (f64::from(point[row]) - turned) as f32
            });
            let camera = Camera {
                rotation: Rotation::new(rotation).expect("a rotation"),
                translation,
                focal_px: [80.0; 2],
                principal_px: [40.0, 30.0],
                width_px: 80,
                height_px: 60,
            };
            let view = View::new(&camera).expect("a sound camera");
            let view = View { dilation: Dilation::at(between(-6.0, 2.0).exp2()), ..view };
            let scale = 1e-4_f32;
            let gaussian =
                Gaussian { centre, scale: [scale; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 1.0, colour: [0.0; 3] };
            let ink = (centre.map(|x| x - 3.33 * scale), centre.map(|x| x + 3.33 * scale));
            let drawn = view.project::<Reference>(&gaussian, Effects::default()).is_some();
            let seen = view.sees_box(ink);
            assert!(!drawn || seen, "{view:?}, {centre:?}");
            n_drawn += u32::from(drawn);
            n_left_out += u32::from(!seen);
        }
        assert!(n_drawn > 2000 && n_left_out > 2000, "{n_drawn} are drawn, {n_left_out} left out");
    }
}

//! What a horizontal band of the image, or of depth, can see: a second test after that of the whole image.

use super::view::{View, dot};
use crate::scene::{Anchor, Gaussian, ink_radius};

/// The rectangle of tiles of a splat may begin or end half a pixel beyond its ink; rounding is far below the rest.
const RECT_SLACK_PX: f32 = 1.0;
/// Rounding of the sums below, relative to their terms.
const ROUNDING: f32 = 1e-5;

/// The image between two rows of pixels, and between two depths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    rows: Option<[Side; 2]>,
    depths: Option<[Side; 2]>,
}

/// One border of a band: whatever lies beyond it draws nothing inside. For depths that is a plane, which the centre of a
/// splat lies before or behind. For rows:
///
/// A splat of centre (x, y, z) whose Gaussian has deviations of at most σ reaches r·fy/z·√(1 + t²) and the dilation's reach
/// from its mean, with r = 3.33·σ and t its slope within the limits of the Jacobian. So it ends above row y₀ when
/// `y + m·z + r·s < 0` for m = (cy − y₀ + reach)/fy and any s ≥ √(1 + t²). Below the band it is the same with −y.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// ±(row y of the rotation) + m·(row z): y + m·z is `normal·p + shift` for a point p of the normalised frame.
    normal: [f32; 3],
    shift: f32,
    /// s.
    stretch: f32,
}

impl View {
    /// The band from row `first_px` up to row `end_px`.
    pub(crate) fn band(&self, [first_px, end_px]: [u16; 2]) -> Band {
        let ([_, fy], [_, cy]) = (self.focal_px, self.principal_px);
        let reach = self.dilation.reach_px + RECT_SLACK_PX;
        let [_, row_y, row_z] = self.rotation;
        let [_, ty, tz] = self.translation;
        let ([_, min], [_, max]) = (self.slope_min, self.slope_max);
        let steepest = if min.abs() > max.abs() { min } else { max };
        let stretch = pocketsplat_half::sqrt(1.0 + steepest * steepest);
        let side = |sign: f32, slope: f32| {
            let ([y0, y1, y2], [z0, z1, z2]) = (row_y, row_z);
            let normal = [sign * y0 + slope * z0, sign * y1 + slope * z1, sign * y2 + slope * z2];
            Side { normal, shift: sign * ty + slope * tz, stretch }
        };
        let above = side(1.0, (cy - f32::from(first_px) + reach) / fy);
        let below = side(-1.0, (f32::from(end_px) - cy + reach) / fy);
        Band { rows: Some([above, below]), depths: None }
    }
}

impl Band {
    /// The whole image.
    pub(crate) const WHOLE: Self = Self { rows: None, depths: None };

    /// The part of it from depth `from` up to depth `end`, which may be infinite.
    pub(crate) fn between_depths(self, view: &View, from: f32, end: f32) -> Self {
        let [_, _, row_z] = view.rotation;
        let [_, _, tz] = view.translation;
        // A depth is rounded before it is compared, here the difference is: of a centre next to a border one says before, the
        // other behind.
        let side = |sign: f32, depth: f32| {
            let shift = sign * (tz - depth) + ROUNDING * (tz.abs() + depth);
            Side { normal: row_z.map(|z| sign * z), shift, stretch: 0.0 }
        };
        Self { depths: Some([side(1.0, from), side(-1.0, end)]), ..self }
    }

    fn sides(&self) -> impl Iterator<Item = &Side> {
        self.rows.iter().chain(&self.depths).flatten()
    }

    /// Whether a splat inside an ink box can reach the band; true more often than needed, never false wrongly.
    ///
    /// # Budget
    /// About 20 multiplications and a square root a border.
    pub(crate) fn sees_box(&self, ink: ([f32; 3], [f32; 3])) -> bool {
        !self.sides().any(|side| side.is_beyond_box(ink))
    }

    /// Whether an offset that `anchor` draws can reach the band; likewise.
    ///
    /// # Budget
    /// 6 multiplications an offset and border.
    pub(crate) fn sees_anchor(&self, anchor: &Anchor<'_>) -> bool {
        let radius = ink_radius(anchor.base_scale);
        !self.sides().any(|side| side.is_beyond_anchor(anchor, radius))
    }

    /// Whether a Gaussian can reach the band; likewise.
    ///
    /// # Budget
    /// 7 multiplications a border.
    pub(crate) fn sees_gaussian(&self, gaussian: &Gaussian) -> bool {
        let radius = ink_radius(gaussian.scale);
        !self.sides().any(|side| side.is_beyond_sphere(gaussian.centre, radius))
    }
}

impl Side {
    /// Whether all splats of a box lie beyond: the box holds a sphere of radius r around each, whose farthest point has
    /// `y + m·z + r·|normal|`; where s is more than that, half of the box's shortest edge bounds r.
    fn is_beyond_box(&self, (min, max): ([f32; 3], [f32; 3])) -> bool {
        let ([n0, n1, n2], [low0, low1, low2], [high0, high1, high2]) = (self.normal, min, max);
        let farther = |n: f32, low: f32, high: f32| n * if n > 0.0 { high } else { low };
        let farthest = farther(n0, low0, high0) + farther(n1, low1, high1) + farther(n2, low2, high2);
        let terms = |n: f32, low: f32, high: f32| n.abs() * (low.abs() + high.abs());
        let size = terms(n0, low0, high0) + terms(n1, low1, high1) + terms(n2, low2, high2) + self.shift.abs();
        let edges = [high0 - low0, high1 - low1, high2 - low2];
        let shortest = edges.into_iter().fold(f32::INFINITY, |least, edge| if edge < least { edge } else { least });
        let excess = self.stretch - pocketsplat_half::sqrt(dot(self.normal, self.normal));
        let excess = if excess > 0.0 { 0.5 * shortest * excess } else { 0.0 };
        // NaN, from absurd cameras, counts as seen here and below.
        farthest + self.shift + excess + ROUNDING * (size + excess) < 0.0
    }

    /// Whether a sphere lies beyond.
    fn is_beyond_sphere(&self, centre: [f32; 3], radius: f32) -> bool {
        let ([n0, n1, n2], [x, y, z]) = (self.normal, centre);
        let [a, b, c] = [n0 * x, n1 * y, n2 * z];
        let reach = radius * self.stretch;
        let size = a.abs() + b.abs() + c.abs() + self.shift.abs() + reach;
        (a + b + c) + self.shift + reach + ROUNDING * size < 0.0
    }

    /// Whether all offsets that an anchor draws lie beyond, each the centre of a sphere of `radius`.
    fn is_beyond_anchor(&self, anchor: &Anchor<'_>, radius: f32) -> bool {
        let ([n0, n1, n2], [l0, l1, l2], [p0, p1, p2]) = (self.normal, anchor.extent, anchor.position);
        let along = [n0 * l0, n1 * l1, n2 * l2];
        let reach = radius * self.stretch;
        let centre = dot(self.normal, anchor.position) + self.shift + reach;
        let size = n0.abs() * p0.abs() + n1.abs() * p1.abs() + n2.abs() * p2.abs() + self.shift.abs() + reach;
        let mut mask = anchor.mask;
        for offset in anchor.offsets {
            let drawn = mask & 1 == 1;
            mask >>= 1;
            let ([along0, along1, along2], [o0, o1, o2]) = (along, *offset);
            let [a, b, c] = [along0 * o0, along1 * o1, along2 * o2];
            let beyond = centre + (a + b + c) + ROUNDING * (size + a.abs() + b.abs() + c.abs()) < 0.0;
            if drawn && !beyond {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::{Band, View};
    use crate::functions::Reference;
    use crate::project::dilation::Dilation;
    use crate::scene::{Anchor, Gaussian};
    use pocketsplat_format::bundle::Effects;
    use pocketsplat_format::{Camera, Rotation};

    const HEIGHT_PX: u16 = 90;

    /// A stream of numbers, the same every time.
    struct Numbers(u32);

    impl Numbers {
        fn between(&mut self, low: f32, high: f32) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            low + (high - low) * (self.0 >> 8) as f32 / 16_777_216.0
        }
    }

    fn view(random: &mut Numbers) -> View {
        // A turn about x, then one about z, some distance away: orthonormal within rounding.
        let [(s, c), (sz, cz)] = [random.between(-0.7, 0.7), random.between(-3.0, 3.0)].map(f32::sin_cos);
        let camera = Camera {
            rotation: Rotation::new([cz, -sz, 0.0, c * sz, c * cz, -s, s * sz, s * cz, c]).expect("a rotation"),
            translation: [random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-0.5, 4.0)],
            focal_px: [80.0, random.between(30.0, 300.0)],
            principal_px: [40.0, random.between(-20.0, 120.0)],
            width_px: 80,
            height_px: HEIGHT_PX,
        };
        let view = View::new(&camera).expect("a sound camera");
        View { dilation: Dilation::at(random.between(-3.0, 3.0).exp2()), ..view }
    }

    #[test]
    fn nothing_that_a_strip_draws_is_left_out_and_most_of_the_rest_is() {
        let mut random = Numbers(1);
        let [mut n_needless, mut n_kept, mut n_boxes_kept, mut n_needless_in_slab, mut n_kept_in_slab] = [0; 5];
        let effects = Effects { anisotropic: cfg!(feature = "anisotropy"), ..Effects::default() };
        for _ in 0..20_000 {
            let view = view(&mut random);
            let first_row = (random.between(0.0, 5.0) as u8).min(4);
            let band = view.band([u16::from(first_row) * 16, (u16::from(first_row) * 16 + 16).min(HEIGHT_PX)]);
            let from = random.between(0.0, 6.0);
            let end = if random.between(0.0, 3.0) < 1.0 { f32::INFINITY } else { from + random.between(0.0, 2.0) };
            let slab = band.between_depths(&view, from, end);
            let offsets = [(); 3].map(|()| [(); 3].map(|()| random.between(-2.0, 2.0)));
            let size = random.between(0.001, 0.3);
            let anchor = Anchor {
                position: [(); 3].map(|()| random.between(-2.0, 2.0)),
                feature: &[],
                extent: [(); 3].map(|()| random.between(0.01, 0.4)),
                base_scale: [(); 3].map(|()| size * random.between(0.1, 1.0)),
                offsets: &offsets,
                mask: random.between(0.0, 8.0) as u32,
            };
            let radius = 3.33 * anchor.base_scale.into_iter().fold(0.0, f32::max);
            let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            let (mut drawn, mut drawn_in_slab) = (false, false);
            for (k, offset) in offsets.iter().enumerate().filter(|(k, _)| anchor.mask >> k & 1 == 1) {
                let centre: [f32; 3] =
                    std::array::from_fn(|axis| anchor.position[axis] + offset[axis] * anchor.extent[axis]);
                for axis in 0..3 {
                    low[axis] = low[axis].min(centre[axis] - radius);
                    high[axis] = high[axis].max(centre[axis] + radius);
                }
                let quaternion = [(); 4].map(|()| random.between(-1.0, 1.0));
                let norm = quaternion.iter().map(|q| q * q).sum::<f32>().sqrt().max(1e-3);
                let gaussian = Gaussian {
                    centre,
                    scale: anchor.base_scale,
                    rotation: quaternion.map(|q| q / norm),
                    opacity: if k == 0 { 1.0 } else { random.between(0.01, 1.0) },
                    colour: [0.0; 3],
                };
                let Some((splat, rect)) = view.project::<Reference>(&gaussian, effects) else { continue };
                if rect.first_row <= first_row && first_row <= rect.last_row {
                    drawn = true;
                    drawn_in_slab |= from <= splat.depth && splat.depth < end;
                }
            }
            let (kept, box_kept) = (band.sees_anchor(&anchor), band.sees_box((low, high)));
            assert!(!drawn || kept, "{view:?}, {band:?}, {anchor:?}");
            assert!(!drawn || box_kept, "{view:?}, {band:?}, {low:?} to {high:?}");
            let (slab_kept, slab_box_kept) = (slab.sees_anchor(&anchor), slab.sees_box((low, high)));
            assert!(!drawn_in_slab || slab_kept, "{view:?}, {slab:?}, {anchor:?}");
            assert!(!drawn_in_slab || slab_box_kept, "{view:?}, {slab:?}, {low:?} to {high:?}");
            n_kept_in_slab += u32::from(!drawn_in_slab && slab_kept);
            n_needless_in_slab += u32::from(!drawn_in_slab);
            n_needless += u32::from(!drawn);
            n_kept += u32::from(!drawn && kept);
            n_boxes_kept += u32::from(!drawn && box_kept && anchor.mask != 0);
        }
        assert!(n_kept * 3 < n_needless, "{n_kept} of {n_needless} needless anchors are kept");
        assert!(n_kept_in_slab * 5 < n_needless_in_slab, "{n_kept_in_slab} of {n_needless_in_slab} in slabs");
        assert!(n_boxes_kept * 2 < n_needless, "{n_boxes_kept} of {n_needless} needless boxes are kept");
    }

    /// The rectangle of a splat begins half a pixel above its ink: such a splat counts in a strip in which it draws nothing.
    #[test]
    fn a_splat_whose_rectangle_alone_reaches_a_strip_is_not_left_out() {
        // A long lens, and a splat of its dilation alone: bounds are nowhere nearer to what they bound.
        let camera = Camera {
            rotation: Rotation::IDENTITY,
            translation: [0.0; 3],
            focal_px: [3000.0; 2],
            principal_px: [40.0, 45.0],
            width_px: 80,
            height_px: HEIGHT_PX,
        };
        let view = View::new(&camera).expect("a sound camera");
        let (row, band) = (1, view.band([16, 32]));
        let mut n_beyond_ink = 0;
        for step in 0..2600 {
            let v = 11.0 + 0.01 * step as f32;
            let (centre, scale) = ([0.0, (v - 45.0) / 3000.0, 1.0], [1e-6; 3]);
            let gaussian = Gaussian { centre, scale, rotation: [1.0, 0.0, 0.0, 0.0], opacity: 1.0, colour: [0.0; 3] };
            let (_, rect) = view.project::<Reference>(&gaussian, Effects::default()).expect("in the image");
            let drawn = rect.first_row <= row && row <= rect.last_row;
            let anchor = Anchor {
                position: centre,
                feature: &[],
                extent: [0.1; 3],
                base_scale: scale,
                offsets: &[[0.0; 3]],
                mask: 1,
            };
            let seen = [band.sees_gaussian(&gaussian), band.sees_anchor(&anchor), band.sees_box(anchor.ink_box())];
            assert!(!drawn || seen == [true; 3], "{v}: {seen:?}");
            let is_far = !(12.0..36.0).contains(&v);
            assert!(!is_far || seen == [false; 3], "{v}: {seen:?}");
            n_beyond_ink += u32::from(drawn && v > 32.0 + 1.9);
        }
        assert!(n_beyond_ink > 20, "{n_beyond_ink} splats touch the strip with their rectangle alone");
    }

    #[test]
    fn a_depth_that_rounding_moves_onto_a_border_is_not_left_out() {
        let random = &mut Numbers(2);
        let mut camera = Camera {
            rotation: Rotation::IDENTITY,
            translation: [0.0; 3],
            focal_px: [80.0; 2],
            principal_px: [40.0, 45.0],
            width_px: 80,
            height_px: HEIGHT_PX,
        };
        for _ in 0..1000 {
            camera.translation[2] = random.between(1.0, 9.0);
            let view = View::new(&camera).expect("a sound camera");
            let z = random.between(-2e-7, 2e-7);
            let anchor = Anchor {
                position: [0.0, 0.0, z],
                feature: &[],
                extent: [0.1; 3],
                base_scale: [0.1; 3],
                offsets: &[[0.0; 3]],
                mask: 1,
            };
            let depth = z + camera.translation[2];
            for (from, end) in [(depth, f32::INFINITY), (0.0, depth.next_up())] {
                let slab = Band::WHOLE.between_depths(&view, from, end);
                assert!(slab.sees_anchor(&anchor), "{view:?}, {slab:?}, {anchor:?}");
            }
        }
    }
}

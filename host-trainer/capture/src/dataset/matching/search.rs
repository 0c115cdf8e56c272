//! The search along a pixel's ray for where its neighbours look like it, coarse to fine.

use glam::{DVec2, Vec2};

use super::Scene;
use super::picture::{Patch, Window};
use super::ray::Ray;

/// A depth is judged by the mean likeness of so many neighbours, those most alike: others may not see it.
const BEST: usize = 3;
/// Rows of the patches that are searched for along the whole ray, and of those that are compared in the end.
const FEW: usize = 4;
const MANY: usize = 7;
/// Likeness at the coarsest size from which a depth is looked at closer.
const COARSE_LIKENESS: f32 = 0.6;
/// Likeness at the finest size, of the mean and of every photograph that counts.
pub(super) const FINE_LIKENESS: f32 = 0.75;
/// Another depth that is likelier than this part of the best makes it doubtful.
const UNIQUE: f32 = 0.9;
/// So many of the likeliest depths are looked at closer.
const CANDIDATES: usize = 3;
/// A way back ends within so many steps of the search at the coarsest size.
const WAY_BACK_STEPS: f32 = 1.5;
/// What stands for the inverse depth 0 where a point is needed.
const FARTHEST: f32 = 1e-6;
/// Depths tried on one ray at most.
const MOST_DEPTHS: usize = 400;

/// Where a photograph shows the point.
pub(super) struct Sighting {
    pub(super) view: usize,
    pub(super) at: DVec2,
}

/// A place of one photograph, searched for in others.
#[derive(Clone, Copy)]
struct Search<'a> {
    scene: &'a Scene,
    view: usize,
    at: [f64; 2],
    others: &'a [usize],
    /// The depth before which nothing is looked for.
    nearest: f64,
}

/// The patch at one size and its ray in every other photograph.
struct AtLevel<const N: usize> {
    level: usize,
    patch: Patch<N>,
    rays: Vec<Ray>,
}

/// Where the place `at` of photograph `view` is seen in `others`, its own place first; `None` where that is doubtful.
pub(super) fn sightings(
    scene: &Scene,
    view: usize,
    at: [f64; 2],
    others: &[usize],
    nearest: f64,
) -> Option<Vec<Sighting>> {
    let search = Search { scene, view, at, others, nearest };
    let coarsest = scene.pictures[view].levels.len() - 1;
    let coarse = search.at_level(coarsest)?;
    let (step, likeness) = search.swept(&coarse);
    let mut peaks: Vec<(f32, f32)> = Vec::new();
    for (k, &own) in likeness.iter().enumerate() {
        let beside = |k: Option<usize>| k.and_then(|k| likeness.get(k)).copied().unwrap_or(-1.0);
        if own >= COARSE_LIKENESS && own >= beside(k.checked_sub(1)) && own > beside(k.checked_add(1)) {
            peaks.push((own, k as f32 * step));
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    peaks.truncate(CANDIDATES);
    let levels: Vec<AtLevel<MANY>> = (0..=coarsest).rev().map(|level| search.at_level(level)).collect::<Option<_>>()?;
    let mut found: Vec<(f32, f32)> =
        peaks.into_iter().map(|(own, depth)| search.refined(&levels, own, depth, step)).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let &(best, inverse_depth) = found.first()?;
    let doubtful =
        found[1..].iter().any(|(own, depth)| (depth - inverse_depth).abs() > 2.0 * step && *own > UNIQUE * best);
    if best < FINE_LIKENESS || doubtful {
        return None;
    }
    search.places(levels.last()?, inverse_depth)
}

impl Search<'_> {
    fn at_level<const N: usize>(&self, level: usize) -> Option<AtLevel<N>> {
        let scale = 0.5_f64.powi(i32::try_from(level).ok()?);
        let picture = &self.scene.pictures[self.view];
        let middle = (DVec2::from(self.at) * scale).as_vec2();
        let patch = picture.levels[level].patch(&Window { middle, column: Vec2::X, row: Vec2::Y })?;
        let ray = |&other: &usize| Ray::new(&picture.camera, self.at, &self.scene.pictures[other].camera, scale);
        Some(AtLevel { level, patch, rays: self.others.iter().map(ray).collect() })
    }

    /// The likeness of every depth, from infinity on, in steps of inverse depth that move the patch by a pixel at most.
    fn swept(&self, coarse: &AtLevel<FEW>) -> (f32, Vec<f32>) {
        let scale = 0.5_f64.powi(i32::try_from(coarse.level).unwrap_or(0));
        let own = &self.scene.pictures[self.view].camera;
        let baseline = |&other: &usize| {
            let camera = &self.scene.pictures[other].camera;
            camera.focal_px[0] * own.centre_world().distance(camera.centre_world())
        };
        let widest = self.others.iter().map(baseline).fold(f64::MIN_POSITIVE, f64::max);
        let nearest = 1.0 / self.nearest;
        let n = (nearest * widest * scale).ceil().clamp(2.0, MOST_DEPTHS as f64);
        let step = (nearest / n) as f32;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most MOST_DEPTHS")]
        let n = n as usize;
        (step, (0..=n).map(|k| self.likeness(coarse, k as f32 * step)).collect())
    }

    /// The mean likeness of the neighbours most alike at a depth; −1 where too few see it.
    fn likeness<const N: usize>(&self, at: &AtLevel<N>, inverse_depth: f32) -> f32 {
        let n = BEST.min(self.others.len());
        let mut best = [-1.0_f32; BEST];
        for (&other, ray) in self.others.iter().zip(&at.rays) {
            let seen = ray.window(inverse_depth).and_then(|window| self.scene.level(other, at.level)?.patch(&window));
            let mut own = seen.map_or(-1.0, |patch| patch.likeness(&at.patch));
            for slot in &mut best {
                if own > *slot {
                    std::mem::swap(&mut own, slot);
                }
            }
        }
        best[..n].iter().sum::<f32>() / n as f32
    }

    /// A depth and its likeness, from the coarsest size to the finest.
    fn refined(&self, levels: &[AtLevel<MANY>], own: f32, inverse_depth: f32, step: f32) -> (f32, f32) {
        let (mut own, mut middle, mut step) = (own, inverse_depth, step);
        for at in levels {
            step *= 0.5;
            let around = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k: f32| (middle + k * step).max(0.0));
            let likeness = around.map(|depth| self.likeness(at, depth));
            let k = (0..5).fold(2, |best, k| if likeness[k] > likeness[best] { k } else { best });
            (own, middle) = (likeness[k], around[k]);
            if k > 0 && k < 4 {
                middle += step * peak([likeness[k - 1], own, likeness[k + 1]]);
            }
        }
        (own, middle.max(0.0))
    }

    /// Where the photographs that look alike show the point, each searched around where its camera puts it, as poses are not exact;
    /// `None` where no two of the likeliest lead back.
    fn places(&self, fine: &AtLevel<MANY>, inverse_depth: f32) -> Option<Vec<Sighting>> {
        let mut alike = Vec::new();
        for (&other, ray) in self.others.iter().zip(&fine.rays) {
            let Some(window) = ray.window(inverse_depth) else { continue };
            if let Some((own, at)) = self.place(fine, other, window) {
                alike.push((own, other, at));
            }
        }
        alike.sort_by(|a, b| b.0.total_cmp(&a.0));
        let leads_back = |&(_, other, at): &(f32, usize, Vec2)| self.leads_back(other, at, inverse_depth);
        if alike.len() < 2 || !alike.iter().take(2).all(leads_back) {
            return None;
        }
        let own = Sighting { view: self.view, at: self.at.into() };
        let others = alike.into_iter().map(|(_, view, at)| Sighting { view, at: at.as_dvec2() });
        Some(std::iter::once(own).chain(others).collect())
    }

    /// The place in another photograph within a pixel of a window, to a part of a pixel, with its likeness.
    fn place(&self, fine: &AtLevel<MANY>, other: usize, window: Window) -> Option<(f32, Vec2)> {
        let level = self.scene.level(other, fine.level)?;
        let likeness = |offset: Vec2| {
            let moved = Window { middle: window.middle + offset, ..window };
            level.patch(&moved).map_or(-1.0, |patch| patch.likeness(&fine.patch))
        };
        let (mut own, mut at) = (likeness(Vec2::ZERO), Vec2::ZERO);
        // Uphill, two steps at most.
        for _ in 0..2 {
            let from = at;
            for offset in [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y] {
                let there = likeness(from + offset);
                if there > own {
                    (own, at) = (there, from + offset);
                }
            }
        }
        if own < FINE_LIKENESS {
            return None;
        }
        let part = |axis: Vec2| peak([likeness(at - axis), own, likeness(at + axis)]) * axis;
        Some((own, window.middle + at + part(Vec2::X) + part(Vec2::Y)))
    }

    /// Whether the search from the place in another photograph, along its own ray, ends where this one began.
    fn leads_back(&self, other: usize, at: Vec2, inverse_depth: f32) -> bool {
        let picture = &self.scene.pictures[other];
        let point = self.scene.point(self.view, self.at, f64::from(inverse_depth.max(FARTHEST)));
        let expected = (picture.camera.rotation * point + picture.camera.translation).z.recip() as f32;
        let back = Search { view: other, at: at.as_dvec2().into(), others: &[self.view], ..*self };
        let Some(coarse) = back.at_level(picture.levels.len() - 1) else { return false };
        let (step, likeness) = back.swept(&coarse);
        let best = (0..likeness.len()).fold(0, |best, k| if likeness[k] > likeness[best] { k } else { best });
        (best as f32 * step - expected).abs() <= WAY_BACK_STEPS * step
    }
}

/// How far from the middle of three the parabola through them peaks, −½ to ½.
fn peak([before, middle, after]: [f32; 3]) -> f32 {
    let curvature = 2.0 * middle - before - after;
    if curvature > 1e-6 { (0.5 * (after - before) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}

//! One bundle, its plan, the memory it draws in, and the picture.

use std::convert::Infallible;
use std::slice;

use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, Plan, Region, Residency, Tile, TileSink,
};
use pocketsplat_instructions::Costs;

use crate::figures::{self, Figures};
use crate::focus;

/// Bytes with which a page may keep sums; a browser may have less than a scene of a million anchors would take.
const MOST_WITH_SUMS: usize = 256 << 20;

/// A bundle that is drawn within one plan after another.
pub struct Scene {
    bundle: Bundle<'static>,
    bound: Option<Bound>,
    costs: Costs,
    frame: Frame,
}

impl Scene {
    /// Checks a bundle.
    ///
    /// # Errors
    /// As [`Bundle::parse`].
    pub fn open(bytes: &'static [u8]) -> Result<Self, DecodeError> {
        let bundle = Bundle::parse(bytes)?;
        let frame = Frame { width_px: 0, rgba: Vec::new() };
        Ok(Self { bundle, bound: None, costs: Costs::measured(), frame })
    }

    /// What the bundle is.
    pub fn figures(&self) -> Figures {
        figures::of_bundle(&self.bundle)
    }

    /// The scene of the first `tiers` tiers.
    pub fn tier_figures(&self, tiers: u8) -> Figures {
        figures::of_tiers(&self.bundle, tiers)
    }

    /// How far away what the preview shows in its middle is.
    pub fn focus(&self) -> Figures {
        vec![("distance", focus::distance(&self.bundle))]
    }

    /// The camera that the bundle holds.
    pub fn preview(&self) -> Camera {
        self.bundle.header().preview
    }

    /// The least memory with which a device draws anything within the other limits of `budget`, and the most that is of use, bytes.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn limits(&self, budget: &Budget) -> Result<Figures, DecodeError> {
        let budget = budget.with_residency(Residency::Auto);
        let least = match Plan::new(&self.bundle, &budget.in_bytes(0)) {
            Err(DecodeError::BudgetTooSmall { needed, .. }) => needed.into(),
            Err(error) => return Err(error),
            Ok(plan) => plan.scratch_len() as f64,
        };
        let most = Plan::new(&self.bundle, &budget.in_bytes(usize::MAX))?.scratch_len() as f64;
        Ok(vec![("leastBytes", least), ("mostBytes", most)])
    }

    /// What a decoder would do within `budget`.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn plan(&self, budget: &Budget) -> Result<Figures, DecodeError> {
        Ok(figures::of_plan(&self.bundle, &self.planned(budget)?))
    }

    /// The plan, without sums where they would take too much of a page's memory.
    fn planned(&self, budget: &Budget) -> Result<Plan, DecodeError> {
        let plan = Plan::new(&self.bundle, budget)?;
        if plan.keeps_sums() && plan.scratch_len() > MOST_WITH_SUMS {
            return Plan::new(&self.bundle, &budget.with_residency(Residency::Auto));
        }
        Ok(plan)
    }

    /// Plans, and makes the decoder that the next frames are drawn by, in exactly the plan's bytes.
    ///
    /// # Errors
    /// As [`Plan::new`] and [`Decoder::bind`]; then there is no decoder.
    pub fn bind(&mut self, budget: &Budget) -> Result<Figures, DecodeError> {
        // Its memory is free before the next one's is taken.
        self.bound = None;
        let plan = self.planned(budget)?;
        self.bound = Some(Bound::new(&self.bundle, plan)?);
        Ok(figures::of_plan(&self.bundle, &plan))
    }

    /// Draws a frame and says what it consisted of.
    ///
    /// # Errors
    /// As [`Decoder::render`]; [`DecodeError::ScratchTooSmall`] where nothing is bound.
    pub fn render(&mut self, camera: &Camera) -> Result<Figures, DecodeError> {
        let Some(bound) = &mut self.bound else {
            return Err(DecodeError::ScratchTooSmall { region: Region::Fast, needed: 1, available: 0 });
        };
        camera.check()?;
        self.frame.clear(camera);
        let report = bound.render(camera, &mut self.frame)?;
        Ok(figures::of_frame(&self.costs, &self.bundle, &bound.plan, camera, &report))
    }

    /// The last frame: `[height, width, 4]`, opaque.
    pub fn rgba(&self) -> &[u8] {
        &self.frame.rgba
    }
}

/// A decoder and the memory that it draws in.
struct Bound {
    plan: Plan,
    decoder: Decoder<'static, 'static>,
    /// What `decoder` borrows; nothing else refers to it.
    scratch: *mut [u8],
}

#[expect(unsafe_code, reason = "a decoder outlives the call that binds it, and so does the memory that it borrows")]
impl Bound {
    fn new(bundle: &Bundle<'static>, plan: Plan) -> Result<Self, DecodeError> {
        let scratch: *mut [u8] = Box::into_raw(vec![0; plan.scratch_len()].into_boxed_slice());
        // SAFETY: the pointer is a box's, valid until `drop` makes a box of it again; this is the only reference.
        let borrowed = unsafe { slice::from_raw_parts_mut(scratch.cast::<u8>(), plan.scratch_len()) };
        match Decoder::bind(bundle, plan, borrowed) {
            Ok(decoder) => Ok(Self { plan, decoder, scratch }),
            Err(error) => {
                // SAFETY: as in `drop`; the decoder that borrowed it was not made.
                drop(unsafe { Box::from_raw(scratch) });
                Err(error)
            }
        }
    }

    fn render(&mut self, camera: &Camera, frame: &mut Frame) -> Result<FrameReport, DecodeError> {
        Ok(self.decoder.render(camera, frame)?)
    }
}

#[expect(unsafe_code, reason = "gives back what `Bound::new` took")]
impl Drop for Bound {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `Box::into_raw`. `decoder` borrows from it, is dropped with this value, and has
        // nothing to do when it is: it holds references alone.
        drop(unsafe { Box::from_raw(self.scratch) });
    }
}

/// A picture that tiles are copied into.
struct Frame {
    width_px: usize,
    rgba: Vec<u8>,
}

impl Frame {
    fn clear(&mut self, camera: &Camera) {
        self.width_px = camera.width_px.into();
        self.rgba.clear();
        self.rgba.resize(4 * self.width_px * usize::from(camera.height_px), 0xff);
    }
}

impl TileSink for Frame {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        for (row, pixels) in rgb.chunks_exact(width.into()).enumerate() {
            let first = (usize::from(y_px) + row) * self.width_px + usize::from(x_px);
            let (targets, _) = self.rgba[4 * first..].as_chunks_mut::<4>();
            for (target, &[red, green, blue]) in targets.iter_mut().zip(pixels) {
                *target = [red, green, blue, 0xff];
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_core::{Budget, DecodeError, MaxSplats};
    use pocketsplat_format::bundle::crc32;

    use super::Scene;

    const STATIC: &[u8] = include_bytes!("../../tests/golden/static.psb");

    fn figure(figures: &[(&str, f64)], name: &str) -> f64 {
        figures.iter().find(|(found, _)| *found == name).unwrap_or_else(|| panic!("{name}: {figures:?}")).1
    }

    /// Of the golden frames' first row: the checksum is of three bytes a pixel.
    #[test]
    fn a_frame_is_the_golden_one() {
        let mut scene = Scene::open(STATIC).expect("a sound bundle");
        let camera = scene.preview();
        let budget =
            Budget::for_frame(camera.width_px, camera.height_px).with_max_splats(MaxSplats::Worst).with_tiers(1);
        scene.bind(&budget).expect("planned");
        let figures = scene.render(&camera).expect("drawn");
        let rgb: Vec<u8> = scene.rgba().as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect();
        let golden = include_str!("../../tests/golden/frames.csv").lines().nth(1).expect("a first row");
        assert_eq!(format!("static,1,0,{:08x}", crc32(&rgb)), golden);
        assert!(figure(&figures, "splats") > 0.0 && figure(&figures, "cortexM.blend") > 1000.0, "{figures:?}");
    }

    #[test]
    fn a_plan_keeps_its_limits_and_the_least_memory_is_the_least() {
        let mut scene = Scene::open(STATIC).expect("a sound bundle");
        let budget = Budget::for_frame(80, 60);
        let limits = scene.limits(&budget).expect("limits");
        let [least, most] = ["leastBytes", "mostBytes"].map(|name| figure(&limits, name) as usize);
        assert!(least < most, "{least} {most}");
        for bytes in [least, most] {
            let plan = scene.bind(&budget.in_bytes(bytes)).expect("enough");
            assert_eq!(figure(&plan, "scratchBytes") as usize, bytes, "{plan:?}");
        }
        let refused = scene.plan(&budget.in_bytes(least - 1));
        assert!(matches!(refused, Err(DecodeError::BudgetTooSmall { .. })), "{refused:?}");
        assert!(scene.bind(&budget.in_bytes(least - 1)).is_err() && scene.render(&scene.preview()).is_err(), "unbound");
    }
}

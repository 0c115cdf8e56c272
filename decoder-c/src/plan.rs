//! How many bytes a scene takes.

use core::slice;

use pocketsplat_core::{Bundle, DecodeError, Overflow, Quality as CoreQuality, Region};

use crate::status::{Failure, Message, Status, status_of};

/// How exactly a frame is drawn.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Every splat, wherever it shows.
    Exact = 0,
    /// Fewer instructions, and differences that photographs hardly tell.
    Balanced = 1,
    /// Fewer still; fine detail is left out.
    Draft = 2,
}

/// What there is to draw with. Begin with psb_budget_for_frame.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// The most that a frame may take, model instructions: about as many as a Cortex-M4 executes. A frame that takes more ends with
    /// PSB_STATUS_OVER_BUDGET. UINT64_MAX for no limit.
    pub most_work: u64,
    /// Bytes of scratch memory that there are.
    pub ram_bytes: usize,
    /// Bytes of slower memory beside it, such as PSRAM or SDRAM; 0 where there is none. It has to be normal memory: where it is Device memory
    /// after reset, as SDRAM at 0xC0000000 is, have the MPU make it normal, or a Cortex-M7 faults.
    pub slow_bytes: usize,
    /// Widest frame, pixels.
    pub width_px: u16,
    /// Highest frame, pixels.
    pub height_px: u16,
    /// Tiers to draw at most, 1 or more; 255 draws all that the file holds.
    pub tiers: u8,
    /// A psb_quality.
    pub quality: u8,
    /// 1 to draw strips with too many splats in slabs of depth, which takes longer; 0 to leave splats out.
    pub slabs: u8,
    /// 1 to draw on two cores, by psb_bind_two: in a single strip, without slabs. 0 to draw on one core.
    pub two_painters: u8,
}

/// What fits into a budget.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Plan {
    /// Bytes of scratch memory that psb_bind or psb_bind_two takes; where nothing fits, those that would do.
    pub scratch_bytes: usize,
    /// Bytes of slower memory that the same call takes beside them, 0 where everything lies in the first; where nothing fits and there is
    /// slower memory, those that would do.
    pub slow_scratch_bytes: usize,
    /// Share of the anchors that is not drawn.
    pub pruning_rate: f32,
    /// Places for splats, on two cores for each.
    pub max_splats: u32,
    /// Tiers that are drawn.
    pub n_tiers: u8,
    /// Horizontal strips of a frame.
    pub n_strips: u8,
    /// Anchors are decoded once, not in every frame.
    pub is_resident: bool,
    /// Gaussians are evaluated once, not in every frame.
    pub is_baked: bool,
}

impl Budget {
    fn to_core(self) -> Result<pocketsplat_core::Budget, Failure> {
        let quality = match self.quality {
            0 => CoreQuality::EXACT,
            1 => CoreQuality::BALANCED,
            2 => CoreQuality::DRAFT,
            other => {
                let needed = "quality needs to be PSB_QUALITY_EXACT, _BALANCED or _DRAFT, 0 to 2";
                return Err(Failure::Number(needed, usize::from(other)));
            }
        };
        let overflow = match self.slabs {
            0 => Overflow::LeaveOut,
            1 => Overflow::Slabs,
            other => return Err(Failure::Number("slabs needs to be 0 or 1", usize::from(other))),
        };
        let frame = pocketsplat_core::Budget::for_frame(self.width_px, self.height_px);
        let memory = frame.in_bytes(self.ram_bytes).with_slow_bytes(self.slow_bytes);
        let scene = memory.with_tiers(self.tiers).with_quality(quality).with_overflow(overflow);
        let scene = scene.with_most_work(self.most_work);
        match (self.two_painters, self.slabs) {
            (0, _) => Ok(scene),
            (1, 0) => Ok(scene.with_two_painters()),
            (1, slabs) => Err(Failure::Number("slabs needs to be 0 where two_painters is 1", usize::from(slabs))),
            (other, _) => Err(Failure::Number("two_painters needs to be 0 or 1", usize::from(other))),
        }
    }
}

impl From<&pocketsplat_core::Plan> for Plan {
    fn from(plan: &pocketsplat_core::Plan) -> Self {
        Self {
            scratch_bytes: plan.scratch_len(),
            slow_scratch_bytes: plan.slow_scratch_len(),
            pruning_rate: plan.pruning_rate(),
            max_splats: plan.max_splats(),
            n_tiers: plan.n_tiers(),
            n_strips: plan.n_strips(),
            is_resident: plan.is_resident(),
            is_baked: plan.is_baked(),
        }
    }
}

/// Checks a bundle, plans for it, and returns what `then` makes of both.
// Neither is returned, nor taken out of its result: a stack frame would hold it several times.
pub(crate) fn with_plan<R>(
    bundle: Option<&'static [u8]>,
    budget: Option<&Budget>,
    then: impl FnOnce(&Bundle<'static>, &pocketsplat_core::Plan) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let parsed = Bundle::parse(bundle.ok_or(Failure::Misuse("bundle is NULL"))?);
    let bundle = parsed.as_ref().map_err(|&error| Failure::Decode(error))?;
    let budget = budget.ok_or(Failure::Misuse("budget is NULL"))?.to_core()?;
    let planned = pocketsplat_core::Plan::new(bundle, &budget);
    let plan = planned.as_ref().map_err(|&error| Failure::Decode(error))?;
    then(bundle, plan)
}

/// The caller's bytes; nothing for NULL.
///
/// # Safety
/// `bytes` is NULL, or points to `len` bytes that stay as they are while the result is used.
pub(crate) unsafe fn bytes_of(bytes: *const u8, len: usize) -> Option<&'static [u8]> {
    // SAFETY: not NULL; the rest is the caller's promise.
    (!bytes.is_null()).then(|| unsafe { slice::from_raw_parts(bytes, len) })
}

/// A budget for frames of at most width_px by height_px within ram_bytes, everything else as good as memory allows.
#[unsafe(no_mangle)]
pub extern "C" fn psb_budget_for_frame(width_px: u16, height_px: u16, ram_bytes: usize) -> Budget {
    Budget {
        most_work: u64::MAX,
        ram_bytes,
        slow_bytes: 0,
        width_px,
        height_px,
        tiers: u8::MAX,
        quality: Quality::Exact as u8,
        slabs: 0,
        two_painters: 0,
    }
}

/// Checks a bundle and says how many bytes the best plan within a budget takes, on two cores both together.
///
/// bundle: bundle_len bytes of a .psb. message: NULL, or where to say what was wrong.
///
/// # Safety
/// Pointers are NULL or point to what the call says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_make_plan(
    bundle: *const u8,
    bundle_len: usize,
    budget: *const Budget,
    plan: *mut Plan,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (bundle, budget, plan, message) =
        unsafe { (bytes_of(bundle, bundle_len), budget.as_ref(), plan.as_mut(), message.as_mut()) };
    let outcome = (|| {
        let plan = plan.ok_or(Failure::Misuse("plan is NULL"))?;
        *plan = Plan::default();
        *plan = with_plan(bundle, budget, |_, found| Ok(Plan::from(found))).inspect_err(|failure| {
            if let Failure::Decode(DecodeError::BudgetTooSmall { region, needed, .. }) = failure {
                match region {
                    Region::Fast => plan.scratch_bytes = *needed as usize,
                    Region::Slow => plan.slow_scratch_bytes = *needed as usize,
                }
            }
        })?;
        Ok(())
    })();
    status_of(outcome, message)
}

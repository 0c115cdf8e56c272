//! A frame drawn on two cores.

use core::ffi::c_void;
use core::mem::{MaybeUninit, align_of, size_of};

use pocketsplat_core::{Bundle, DecodeError, Plan};

use crate::camera::Camera;
use crate::decoder::{DECODER_ALIGN, Placed, Report, TileFn, Tiles, bind};
use crate::plan::Budget;
use crate::status::{Failure, Message, Status, status_of};

/// Bytes that suffice for a psb_pair on every target.
pub const PAIR_BYTES: usize = 4096;

/// Two decoders that draw frames of one scene together, bound by psb_bind_two. They lie in memory of the caller, have nothing to free, and may be
/// forgotten at any time; their scratch memory is then the caller's again.
pub struct Pair([pocketsplat_core::Decoder<'static, 'static>; 2]);

const _: () = assert!(size_of::<Pair>() <= PAIR_BYTES && align_of::<Pair>() <= DECODER_ALIGN);

impl Placed for Pair {
    const NULL: &'static str = "pair is NULL";
    const TOO_SHORT: &'static str = "place_len needs to be psb_pair_bytes() at least";
    const TWO_PAINTERS: u8 = 1;
    const OTHER_CALL: &'static str = "two_painters needs to be 1 for psb_bind_two; psb_bind takes 0";

    #[inline(never)]
    fn bind_at(
        place: &mut MaybeUninit<Self>,
        bundle: &Bundle<'static>,
        plan: &Plan,
        regions: [&'static mut [u8]; 2],
    ) -> Result<(), DecodeError> {
        let place = place.as_mut_ptr();
        match pocketsplat_core::Decoder::bind_two(bundle, *plan, regions) {
            Ok(painters) => {
                // SAFETY: memory of a pair, of which nothing is read; its only field is written.
                unsafe { (&raw mut (*place).0).write(painters) };
                Ok(())
            }
            Err(error) => Err(error),
        }
    }
}

/// What one core is to do: call run with state, once.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// Does it.
    pub run: Option<unsafe extern "C" fn(state: *mut c_void)>,
    /// What run takes.
    pub state: *mut c_void,
}

/// Does both tasks at the same time, here on the core that calls and there on the other, and returns when both are done. A task has to
/// see what was written before it, and the core that goes on what the task wrote: with barriers where the cores need them.
pub type JoinFn = Option<unsafe extern "C" fn(user: *mut c_void, here: Task, there: Task)>;

/// A task that is done once, however often it is called.
type Once<'t> = Option<&'t mut (dyn FnMut() + Send)>;

/// The task as C calls it.
fn task_of(once: &mut Once<'_>) -> Task {
    unsafe extern "C" fn run(state: *mut c_void) {
        // SAFETY: `state` is that of `task_of`, whose memory lives until the caller's function returns; one core at a time uses it.
        let once = unsafe { &mut *state.cast::<Once<'_>>() };
        if let Some(task) = once.take() {
            task();
        }
    }
    Task { run: Some(run), state: core::ptr::from_mut(once).cast() }
}

/// Bytes of a psb_pair on this target, PSB_PAIR_BYTES at most; its alignment is PSB_DECODER_ALIGN at most.
#[unsafe(no_mangle)]
pub extern "C" fn psb_pair_bytes() -> usize {
    size_of::<Pair>()
}

/// Checks a bundle, plans for it, and binds two decoders to it, which draw frames together by psb_render_by_two.
///
/// place: place_len bytes for both, psb_pair_bytes() or PSB_PAIR_BYTES, aligned to PSB_DECODER_ALIGN. budget: with two_painters 1. pair: gets them, NULL
/// where the call fails. The rest as psb_bind has it.
///
/// # Safety
/// As for psb_bind.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_bind_two(
    place: *mut c_void,
    place_len: usize,
    bundle: *const u8,
    bundle_len: usize,
    budget: *const Budget,
    scratch: *mut u8,
    scratch_len: usize,
    slow: *mut u8,
    slow_len: usize,
    pair: *mut *mut Pair,
    message: *mut Message,
) -> Status {
    let (place, bundle) = ((place, place_len), (bundle, bundle_len));
    // SAFETY: the caller's promise.
    unsafe { bind(place, bundle, budget, (scratch, scratch_len), (slow, slow_len), pair, message) }
}

/// Draws the scene as a camera sees it on two cores: the same pixels as psb_render.
///
/// tile: is called on both cores, with here_user on this one and there_user on the other; each tile comes once. Where it does not return 0, its core
/// draws no more; the other one finishes its part. join: does two tasks at the same time, see psb_join; a frame calls it twice at most. join_user: passed on to
/// it. reports: NULL, or two, where to say what each core did; scratch_used of either is that of both. message: NULL, or where to say what was wrong. After
/// an error the next frame is drawn as if nothing had been.
///
/// # Safety
/// Pointers are NULL or point to what the call says; the pair is bound, and neither function uses it. join runs each task on one core at a time,
/// returns only when both have ended, and runs none after that.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_render_by_two(
    pair: *mut Pair,
    camera: *const Camera,
    tile: TileFn,
    here_user: *mut c_void,
    there_user: *mut c_void,
    join: JoinFn,
    join_user: *mut c_void,
    reports: *mut Report,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (pair, camera, message) = unsafe { (pair.as_mut(), camera.as_ref(), message.as_mut()) };
    let outcome = (|| {
        let Pair(painters) = pair.ok_or(Failure::Misuse(Pair::NULL))?;
        let camera = camera.ok_or(Failure::Misuse("camera is NULL"))?.to_core()?;
        let function = tile.ok_or(Failure::Misuse("tile is NULL"))?;
        let join = join.ok_or(Failure::Misuse("join is NULL"))?;
        let [mut here, mut there] = [here_user, there_user].map(|user| Tiles { function, user });
        let mut is_undone = false;
        let found =
            pocketsplat_core::Decoder::render_by_two(painters, &camera, [&mut here, &mut there], |here, there| {
                let (mut here, mut there) = (Some(here), Some(there));
                // SAFETY: the caller's function, which returns when both are done.
                unsafe { join(join_user, task_of(&mut here), task_of(&mut there)) };
                is_undone |= here.is_some() || there.is_some();
            });
        if is_undone {
            return Err(Failure::Misuse("join left a task undone"));
        }
        let found = found?;
        if !reports.is_null() {
            // SAFETY: two of them, the caller's promise.
            unsafe { reports.cast::<[Report; 2]>().write(found.map(Report::from)) };
        }
        Ok(())
    })();
    status_of(outcome, message)
}

//! A decoder in the caller's memory.

use core::ffi::c_void;
use core::mem::{MaybeUninit, align_of, size_of};
use core::slice;

use pocketsplat_core::{Bundle, DecodeError, Drawing, FrameReport, PixelFormat, Plan, Tile, TileSink};

use crate::camera::Camera;
use crate::plan::{Budget, bytes_of, with_plan};
use crate::status::{Failure, Message, Status, status_of};

/// Bytes that suffice for a psb_decoder on every target.
pub const DECODER_BYTES: usize = 3328;

/// Alignment that suffices for a psb_decoder on every target.
pub const DECODER_ALIGN: usize = 8;

/// A frame that is begun, and what its pixels are handed out as.
pub(crate) struct Begun {
    pub(crate) drawing: Drawing<'static, 'static, 'static>,
    pub(crate) format: PixelFormat,
}

/// A decoder that is bound to a bundle and to its scratch memory. It lies in memory of the caller, has nothing to free, and may be
/// forgotten at any time; its scratch memory is then the caller's again.
pub struct Decoder {
    /// Borrows `bound` as long as it is there. So nobody may borrow a whole `Decoder`, and nobody `bound` before this is gone.
    begun: Option<Begun>,
    bound: pocketsplat_core::Decoder<'static, 'static>,
}

impl Decoder {
    /// What is bound, without a frame that was begun.
    ///
    /// # Safety
    /// `decoder` is NULL or bound, and nobody uses it as long as the result is used, but by what [`keep`](Self::keep) takes.
    pub(crate) unsafe fn bound(
        decoder: *mut Self,
    ) -> Result<&'static mut pocketsplat_core::Decoder<'static, 'static>, Failure> {
        if decoder.is_null() {
            return Err(Failure::Misuse("decoder is NULL"));
        }
        // SAFETY: not NULL, and bound. One field after the other: what borrowed the second one is gone.
        unsafe {
            (*decoder).begun = None;
            Ok(&mut (*decoder).bound)
        }
    }

    /// Keeps a frame that was begun with what [`bound`](Self::bound) gave.
    ///
    /// # Safety
    /// `decoder` is bound.
    pub(crate) unsafe fn keep(decoder: *mut Self, begun: Begun) {
        // SAFETY: not NULL, and bound; the other field is not touched.
        unsafe { (*decoder).begun = Some(begun) };
    }

    /// The frame that was begun.
    ///
    /// # Safety
    /// `decoder` is NULL or bound, and nobody uses it as long as the result is used.
    pub(crate) unsafe fn begun(decoder: *mut Self) -> Result<&'static mut Begun, Failure> {
        if decoder.is_null() {
            return Err(Failure::Misuse("decoder is NULL"));
        }
        // SAFETY: not NULL, and bound; the other field, which this one borrows, is not touched.
        let begun = unsafe { &mut (*decoder).begun };
        begun.as_mut().ok_or(Failure::Misuse("no frame is begun: call psb_begin first; psb_render ends what it began"))
    }
}

const _: () = assert!(size_of::<Decoder>() <= DECODER_BYTES && align_of::<Decoder>() <= DECODER_ALIGN);

/// Bytes of a psb_decoder on this target, PSB_DECODER_BYTES at most; its alignment is PSB_DECODER_ALIGN at most.
#[unsafe(no_mangle)]
pub extern "C" fn psb_decoder_bytes() -> usize {
    size_of::<Decoder>()
}

/// What a frame consisted of.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    /// Anchors that were decoded for this frame.
    pub anchors_decoded: u32,
    /// Anchors whose heads ran.
    pub anchors_visible: u32,
    /// Splats drawn.
    pub splats: u32,
    /// Splats left out because there was no memory for them.
    pub splats_dropped: u32,
    /// Pairs of a pixel and a splat evaluated for it.
    pub pixel_splats: u32,
    /// Bytes of the scratch memory that this frame needed.
    pub scratch_used: u32,
}

impl From<FrameReport> for Report {
    fn from(found: FrameReport) -> Self {
        Self {
            anchors_decoded: found.anchors_decoded,
            anchors_visible: found.anchors_visible,
            splats: found.splats,
            splats_dropped: found.splats_dropped,
            pixel_splats: found.pixel_splats,
            scratch_used: found.scratch_used,
        }
    }
}

/// Takes one tile of a frame: 8-bit RGB, row by row, width × height pixels, at (x_px, y_px). What is not 0 ends the frame.
pub type TileFn = Option<
    unsafe extern "C" fn(user: *mut c_void, x_px: u16, y_px: u16, width: u16, height: u16, rgb: *const u8) -> i32,
>;

/// Hands tiles to the caller's function.
pub(crate) struct Tiles {
    pub(crate) function: unsafe extern "C" fn(*mut c_void, u16, u16, u16, u16, *const u8) -> i32,
    pub(crate) user: *mut c_void,
}

// SAFETY: where psb_render_by_two calls the function on the other core, `user` is the pointer that the caller gave for that core.
unsafe impl Send for Tiles {}

impl TileSink for Tiles {
    type Error = i32;

    fn tile(&mut self, Tile { x_px, y_px, width, height, rgb, .. }: Tile<'_>) -> Result<(), i32> {
        // SAFETY: the caller's function, with the pixels that its description says.
        match unsafe { (self.function)(self.user, x_px, y_px, width, height, rgb.as_ptr().cast()) } {
            0 => Ok(()),
            code => Err(code),
        }
    }
}

/// The caller's memory; none for NULL.
///
/// # Safety
/// `bytes` is NULL, or points to `len` bytes that nobody else uses as long as the result is used.
unsafe fn memory_of(bytes: *mut u8, len: usize) -> &'static mut [u8] {
    // SAFETY: not NULL; the rest is the caller's promise.
    if bytes.is_null() { &mut [] } else { unsafe { slice::from_raw_parts_mut(bytes, len) } }
}

/// What is made in the caller's memory.
pub(crate) trait Placed: Sized {
    /// How the call and its arguments are named.
    const NULL: &'static str;
    const TOO_SHORT: &'static str;
    /// What the budget has to say, and what is wrong where it does not.
    const TWO_PAINTERS: u8;
    const OTHER_CALL: &'static str;

    /// Makes it in `place`; an error leaves that as it was.
    // What decoder-core returns is moved once, out of its result: a result of `Self` would lie on the stack several times. Not inlined, for the
    // caller's stack frame would keep it while bundles are checked.
    fn bind_at(
        place: &mut MaybeUninit<Self>,
        bundle: &Bundle<'static>,
        plan: &Plan,
        regions: [&'static mut [u8]; 2],
    ) -> Result<(), DecodeError>;
}

impl Placed for Decoder {
    const NULL: &'static str = "decoder is NULL";
    const TOO_SHORT: &'static str = "place_len needs to be psb_decoder_bytes() at least";
    const TWO_PAINTERS: u8 = 0;
    const OTHER_CALL: &'static str = "two_painters needs to be 0 for psb_bind; psb_bind_two takes 1";

    #[inline(never)]
    fn bind_at(
        place: &mut MaybeUninit<Self>,
        bundle: &Bundle<'static>,
        plan: &Plan,
        regions: [&'static mut [u8]; 2],
    ) -> Result<(), DecodeError> {
        let place = place.as_mut_ptr();
        match pocketsplat_core::Decoder::bind(bundle, *plan, regions) {
            Ok(bound) => {
                // SAFETY: memory of a decoder, of which nothing is read; both of its fields are written.
                unsafe {
                    (&raw mut (*place).bound).write(bound);
                    (&raw mut (*place).begun).write(None);
                }
                Ok(())
            }
            Err(error) => Err(error),
        }
    }
}

/// The caller's memory: begin and length.
pub(crate) type Memory<T> = (*mut T, usize);

/// Checks a bundle, plans for it, and makes a `T` in `place`.
///
/// # Safety
/// As for [`psb_bind`].
pub(crate) unsafe fn bind<T: Placed>(
    (place, place_len): Memory<c_void>,
    (bundle, bundle_len): (*const u8, usize),
    budget: *const Budget,
    (scratch, scratch_len): Memory<u8>,
    (slow, slow_len): Memory<u8>,
    made: *mut *mut T,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (bundle, budget, made, message) =
        unsafe { (bytes_of(bundle, bundle_len), budget.as_ref(), made.as_mut(), message.as_mut()) };
    let outcome = (|| {
        let made = made.ok_or(Failure::Misuse(T::NULL))?;
        *made = core::ptr::null_mut();
        let place = place.cast::<T>();
        if place.is_null() || !place.is_aligned() {
            return Err(Failure::Misuse("place is NULL or not aligned to PSB_DECODER_ALIGN"));
        }
        if place_len < size_of::<T>() {
            return Err(Failure::Number(T::TOO_SHORT, place_len));
        }
        if let Some(Budget { two_painters: found @ 0..2, .. }) = budget
            && *found != T::TWO_PAINTERS
        {
            return Err(Failure::Misuse(T::OTHER_CALL));
        }
        with_plan(bundle, budget, |bundle, plan| {
            if scratch.is_null() && plan.scratch_len() > 0 {
                return Err(Failure::Misuse("scratch is NULL"));
            }
            if slow.is_null() && plan.slow_scratch_len() > 0 {
                return Err(Failure::Misuse("slow is NULL, and the plan takes slow memory"));
            }
            // SAFETY: the caller's promise.
            let regions = unsafe { [memory_of(scratch, scratch_len), memory_of(slow, slow_len)] };
            // SAFETY: not NULL, long enough and aligned, as was checked; nobody else uses it, the caller's promise.
            let uninit = unsafe { &mut *place.cast::<MaybeUninit<T>>() };
            T::bind_at(uninit, bundle, plan, regions)?;
            *made = place;
            Ok(())
        })
    })();
    status_of(outcome, message)
}

/// Checks a bundle, plans for it, and binds a decoder to it.
///
/// place: place_len bytes for the decoder, psb_decoder_bytes() or PSB_DECODER_BYTES, aligned to PSB_DECODER_ALIGN. scratch: scratch_len bytes of any
/// alignment, as many as psb_make_plan said or more. slow: likewise slow_len bytes of slower memory; NULL where slow_scratch_bytes of the plan is
/// 0. budget: with two_painters 0. decoder: gets the decoder, NULL where the call fails. message: NULL, or where to say what was wrong.
///
/// # Safety
/// Pointers are NULL or point to what the call says. Bundle, place, scratch and slow lie apart, stay where they are, and nobody else writes
/// to them as long as the decoder is used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_bind(
    place: *mut c_void,
    place_len: usize,
    bundle: *const u8,
    bundle_len: usize,
    budget: *const Budget,
    scratch: *mut u8,
    scratch_len: usize,
    slow: *mut u8,
    slow_len: usize,
    decoder: *mut *mut Decoder,
    message: *mut Message,
) -> Status {
    let (place, bundle) = ((place, place_len), (bundle, bundle_len));
    // SAFETY: the caller's promise.
    unsafe { bind(place, bundle, budget, (scratch, scratch_len), (slow, slow_len), decoder, message) }
}

/// Draws the scene as a camera sees it and hands it to a function tile by tile.
///
/// user: passed on to tile. report: NULL, or where to say what the frame consisted of. message: NULL, or where to say what was wrong. After an
/// error the next frame is drawn as if nothing had been. psb_begin draws the same frame piece by piece.
///
/// # Safety
/// Pointers are NULL or point to what the call says; the decoder is bound, and the function does not use it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_render(
    decoder: *mut Decoder,
    camera: *const Camera,
    tile: TileFn,
    user: *mut c_void,
    report: *mut Report,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (camera, report, message) = unsafe { (camera.as_ref(), report.as_mut(), message.as_mut()) };
    let outcome = (|| {
        // SAFETY: NULL or a bound decoder, the caller's promise.
        let bound = unsafe { Decoder::bound(decoder) }?;
        let camera = camera.ok_or(Failure::Misuse("camera is NULL"))?.to_core()?;
        let function = tile.ok_or(Failure::Misuse("tile is NULL"))?;
        let found = bound.render(&camera, &mut Tiles { function, user })?;
        if let Some(report) = report {
            *report = found.into();
        }
        Ok(())
    })();
    status_of(outcome, message)
}

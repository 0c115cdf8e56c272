//! The façade: a bundle, a plan and the caller's memory bound together, drawing frames.

mod bind;
mod by_two;
mod collect;
mod count;
mod drawing;
mod first_come;
mod frame;
mod overflow;
mod pass;
mod pixel_format;
mod render_error;
mod report;
mod row;
mod scratch;
mod share;
mod slab_index;
mod source;
mod splats;
mod strip;
mod strips_of_chunks;
#[cfg(test)]
mod tests;
mod tile;

pub use count::{count_gaussians, count_scratch_len};
pub use drawing::Drawing;
pub use pixel_format::{ByteOrder, PixelFormat, Rounding};
pub use render_error::RenderError;
pub use report::FrameReport;
pub use row::TileRow;
pub use scratch::Scratch;
pub use tile::{Tile, TileSink};

use core::fmt;

use pocketsplat_format::{Bundle, Camera, DecodeError, Stopwatch};

use crate::arithmetic::{Arithmetic, ReferenceArithmetic};
use crate::budget::Plan;
use crate::raster::Pixel;
use pass::PlannedChunks;
use source::GaussianSource;
use splats::SplatStore;

/// Draws frames of one bundle with the memory it was bound to, computed as `A` says.
pub struct Decoder<'b, 's, A: Arithmetic = ReferenceArithmetic> {
    bundle: Bundle<'b>,
    plan: Plan,
    source: GaussianSource<'b, 's, A::Heads>,
    /// `[TILE_PIXELS]` of the current tile, or of each tile of a strip when strips are drawn in slabs.
    pixels: &'s mut [Pixel],
    /// `[TILE_PIXELS]` a finished tile.
    rgb: &'s mut [[u8; 3]],
    splats: SplatStore<'s>,
}

impl<'b, 's> Decoder<'b, 's> {
    /// Takes `scratch`, converts the heads' weights into it, compares the checksum of every chunk of the planned tiers, and
    /// decodes them, or evaluates their Gaussians, if the plan says so.
    ///
    /// Dropping the decoder gives the memory back: pass `&mut scratch`, and bind another bundle in the same bytes afterwards.
    ///
    /// ```
    /// # fn main() -> Result<(), pocketsplat_core::DecodeError> {
    /// # let first = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
    /// # let second = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example-context.psb"));
    /// use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, Plan};
    ///
    /// /// Draws a bundle in memory that it has only as long as the call lasts; returns the pixels.
    /// fn show(bundle: &Bundle<'_>, scratch: &mut [u8]) -> Result<usize, DecodeError> {
    ///     let plan = Plan::new(bundle, &Budget::for_frame(32, 24).in_bytes(scratch.len()))?;
    ///     let mut decoder = Decoder::bind(bundle, plan, scratch)?;
    ///     let mut drawing = decoder.begin(&bundle.header().preview.resized(32, 24))?;
    ///     let mut n_pixels = 0;
    ///     while let Some(tile) = drawing.next_tile()? {
    ///         n_pixels += tile.rgb.len();
    ///     }
    ///     Ok(n_pixels)
    /// }
    ///
    /// let mut scratch = [0; 8 * 1024]; // or a `&'static mut [u8]`: pass `&mut *scratch`, which lends it
    /// assert_eq!(show(&Bundle::parse(first)?, &mut scratch)?, 32 * 24);
    /// scratch.fill(0); // the caller's again, for anything
    /// assert_eq!(show(&Bundle::parse(second)?, &mut scratch)?, 32 * 24);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// Two regions of memory go into an array, the fast one first; the frames are the same as with one:
    ///
    /// ```no_run
    /// # use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, Plan};
    /// # fn bound(bundle: &Bundle<'_>, sram: &mut [u8], psram: &mut [u8]) -> Result<(), DecodeError> {
    /// let plan = Plan::new(bundle, &Budget::for_frame(320, 240).in_bytes(sram.len()).with_slow_bytes(psram.len()))?;
    /// for part in plan.memory() {
    ///     // For instance `Scene` and `Splats` in `Slow`, with the bytes of each.
    ///     # let _ = part;
    /// }
    /// let decoder = Decoder::bind(bundle, plan, [sram, psram])?;
    /// # let _ = decoder;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`] names the region and the bytes needed; [`DecodeError::PlanMismatch`] when `plan` is another
    /// bundle's; unless the budget [skips damage](crate::Budget::skipping_damage), [`DecodeError::ChunkChecksum`] names the damaged
    /// chunk, and so does [`DecodeError::ChunkStream`] for resident anchors and baked Gaussians; [`DecodeError::OutOfRange`] when those
    /// are more than the bundle says.
    ///
    /// # Budget
    /// Exactly [`Plan::scratch_len`] and [`Plan::slow_scratch_len`] bytes of `scratch`; reads the whole bundle once, about 8 instructions
    /// a byte, and for resident anchors 55 to 80 a symbol; baked Gaussians take the heads of every anchor besides. The plan is compared
    /// with one that is made again, which takes as long as [`Plan::new`].
    pub fn bind(bundle: &Bundle<'b>, plan: Plan, scratch: impl Into<Scratch<'s>>) -> Result<Self, DecodeError> {
        Self::bind_in(bundle, plan, scratch)
    }

    /// As [`bind`](Self::bind), with another arithmetic: `Decoder::bind_in::<WithoutFpu>(…)`.
    ///
    /// # Errors
    /// As for [`bind`](Self::bind).
    ///
    /// # Budget
    /// As for [`bind`](Self::bind); no arithmetic takes more memory than the reference.
    pub fn bind_in<A: Arithmetic>(
        bundle: &Bundle<'b>,
        plan: Plan,
        scratch: impl Into<Scratch<'s>>,
    ) -> Result<Decoder<'b, 's, A>, DecodeError> {
        Decoder::bind_regions(bundle, plan, scratch.into())
    }

    /// As [`bind_in`](Self::bind_in), for two cores: two decoders that share the scene, and draw frames [together](Self::render_by_two).
    ///
    /// # Errors
    /// As for [`bind`](Self::bind); [`DecodeError::PlanMismatch`] also for a plan without
    /// [two painters](crate::Budget::with_two_painters), or with strips or slabs asked for after that. (With a plan of two `bind` makes the first
    /// painter alone.)
    ///
    /// # Budget
    /// As for [`bind`](Self::bind).
    pub fn bind_two<A: Arithmetic>(
        bundle: &Bundle<'b>,
        plan: Plan,
        scratch: impl Into<Scratch<'s>>,
    ) -> Result<[Decoder<'b, 's, A>; 2], DecodeError> {
        Decoder::bind_two_regions(bundle, plan, scratch.into())
    }
}

impl<'b, 's, A: Arithmetic> Decoder<'b, 's, A> {
    /// The bundle it draws.
    #[must_use]
    pub fn bundle(&self) -> &Bundle<'b> {
        &self.bundle
    }

    /// Draws the scene as `camera` sees it and hands it to `sink` tile by tile.
    ///
    /// A view with more splats than planned draws those of the file's first anchors, in all strips the same, and reports how
    /// many it left out; or it draws a strip in several slabs of depth if the [budget](crate::Overflow) says so.
    ///
    /// # Errors
    /// [`RenderError::Sink`] with the first error of `sink`, which gets no tile after it. [`RenderError::Decode`] with
    /// [`DecodeError::OutOfRange`] for a frame larger than planned and [`DecodeError::BadFloat`] for an unusable camera,
    /// before the first tile; with [`DecodeError::ChunkStream`] for a chunk that no writer makes, which with strips and
    /// streamed anchors may come after some. After any of them the decoder draws the next frame as if nothing had been.
    ///
    /// # Budget
    /// No memory beyond the bound one, under 5 KiB of stack. Work of one strip: every anchor of a chunk in view is decoded
    /// unless it is resident, the heads run for anchors that pass the prefilter, unless Gaussians are baked, and a pixel is finished when its
    /// transmittance falls below 1e-4. Of several strips each does so for the chunks and anchors that can reach it, as many of them at once as
    /// there are places for; but the first time goes over the whole view to see that all strips have places enough, unless that follows
    /// from the directory.
    pub fn render<S: TileSink>(&mut self, camera: &Camera, sink: &mut S) -> Result<FrameReport, RenderError<S::Error>> {
        self.render_watched(camera, sink, &mut ())
    }

    /// As [`render`](Self::render), and tells `watch` where the work goes.
    ///
    /// # Errors
    /// As for [`render`](Self::render).
    pub fn render_watched<S: TileSink>(
        &mut self,
        camera: &Camera,
        sink: &mut S,
        watch: &mut impl Stopwatch,
    ) -> Result<FrameReport, RenderError<S::Error>> {
        self.draw_frame(camera, sink, watch)
    }

    /// Draws a frame on two cores: the pixels of [`render`](Self::render), of which the first sink gets some tiles, row by row from the top,
    /// and the second sink those behind them, at the same time. Returns what each painter did.
    ///
    /// * `painters`: what [`bind_two`](Self::bind_two) made. * `join`: does both of what it is given, at the same time, and returns when both are
    ///   done: the first thing here, the second on the other core. A frame calls it twice, to gather splats and to blend them.
    ///
    /// ```
    /// # fn main() -> Result<(), pocketsplat_core::DecodeError> {
    /// # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
    /// # let mut scratch = [0; 24 * 1024];
    /// # struct Pixels(usize);
    /// # impl pocketsplat_core::TileSink for Pixels {
    /// #     type Error = core::convert::Infallible;
    /// #     fn tile(&mut self, tile: pocketsplat_core::Tile<'_>) -> Result<(), Self::Error> { self.0 += tile.rgb.len(); Ok(()) }
    /// # }
    /// use pocketsplat_core::{Budget, Bundle, Decoder, Plan};
    ///
    /// let bundle = Bundle::parse(bytes)?;
    /// let plan = Plan::new(&bundle, &Budget::for_frame(32, 24).with_two_painters())?;
    /// let mut painters: [Decoder; 2] = Decoder::bind_two(&bundle, plan, &mut scratch)?;
    /// let (mut above, mut below) = (Pixels(0), Pixels(0)); // sinks
    /// let camera = &bundle.header().preview;
    /// let reports = Decoder::render_by_two(&mut painters, camera, [&mut above, &mut below], |here, there| {
    ///     std::thread::scope(|scope| {
    ///         scope.spawn(there);
    ///         here();
    ///     });
    /// })?;
    /// assert_eq!(reports[0].splats + reports[1].splats, 5);
    /// assert_eq!(above.0 + below.0, 32 * 24);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As for [`render`](Self::render); after an error one of the sinks may have got more tiles than the other.
    /// [`DecodeError::PlanMismatch`] for decoders that [`bind_two`](Self::bind_two) did not make, [`DecodeError::Internal`] when `join` leaves one
    /// of the two undone.
    ///
    /// # Budget
    /// As [`render`](Self::render), about half of it each: of each chunk that waits in memory half, of those that are decoded chunks with half of
    /// the anchors, then the tiles that half of the splats lie in. Each sorts the splats of its tiles, and the first finds where they are divided.
    pub fn render_by_two<S>(
        painters: &mut [Self; 2],
        camera: &Camera,
        sinks: [&mut S; 2],
        join: impl FnMut(&mut (dyn FnMut() + Send), &mut (dyn FnMut() + Send)),
    ) -> Result<[FrameReport; 2], RenderError<S::Error>>
    where
        S: TileSink + Send,
        S::Error: Send,
    {
        Self::draw_by_two(painters, camera, sinks, join)
    }

    /// Begins a frame that comes tile by tile, each when it is asked for: the same pixels as [`render`](Self::render)'s.
    ///
    /// # Errors
    /// [`DecodeError::OutOfRange`] for a frame larger than planned and [`DecodeError::BadFloat`] for an unusable camera.
    ///
    /// # Budget
    /// No memory beyond the bound one, but for the drawing itself, 1.1 KiB. At most 2,048 looks at records of the directory; where
    /// damage is skipped in slabs, one at each record, and the checksums of the chunks in view.
    pub fn begin(&mut self, camera: &Camera) -> Result<Drawing<'_, 'b, 's, A>, DecodeError> {
        let view = self.view_of(camera)?;
        Ok(self.begin_frame(camera, view))
    }

    /// Whether damaged chunks are left out.
    fn skips_damage(&self) -> bool {
        self.plan.budget().skips_damage
    }

    /// The chunks of the tiers that are drawn.
    fn planned_chunks(&self) -> PlannedChunks<'b> {
        PlannedChunks::new(self.bundle.chunks(), self.n_planned_chunks())
    }

    /// How many they are.
    fn n_planned_chunks(&self) -> u32 {
        self.bundle.up_to_tier(self.plan.n_tiers()).n_chunks
    }
}

impl<A: Arithmetic> fmt::Debug for Decoder<'_, '_, A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Decoder").field("plan", &self.plan).finish_non_exhaustive()
    }
}

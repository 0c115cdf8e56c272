//! Any bundle draws or is refused, and where its memory lies and how much there is changes no pixel.

use pocketsplat_core::{
    Arithmetic, Bundle, Camera, DecodeError, Decoder, Field, FrameReport, MaxSplats, Overflow, Plan,
    ReferenceArithmetic, Residency, Strips, WithoutFpu,
};

use super::MOST_ANCHORS;
use super::blame::check_blame;
use super::frame::Frame;
use super::setting::Setting;

/// Slow memory without limit.
const SLOW_BYTES: usize = 1 << 30;

/// A bundle draws or is refused, and with damage left out it draws or is refused for another reason. So it does in every way to
/// draw the frame that the bytes behind the file ask for, and the frames of all ways are the same.
///
/// Checksums are made right first, so that damage gets behind them.
pub fn draw(bytes: &[u8]) {
    let setting = Setting::behind(bytes);
    let mut bytes = bytes.to_vec();
    let Some(bundle) = setting.bundle(&mut bytes) else { return };
    if bundle.n_anchors() > MOST_ANCHORS {
        return;
    }
    let job = Job { bundle: &bundle, setting: &setting, camera: setting.camera(&bundle.header().preview) };
    if job.camera.check().is_err() {
        // Unless the plan or the bundle is refused before.
        assert!(job.strict::<ReferenceArithmetic>(job.streamed()).is_err(), "an unusable camera");
        return;
    }
    if setting.without_fpu {
        job.compare_ways::<WithoutFpu>();
    } else {
        job.compare_ways::<ReferenceArithmetic>();
        job.compare_with_damage_left_out();
    }
}

/// A frame to draw.
struct Job<'a, 'b> {
    bundle: &'a Bundle<'b>,
    setting: &'a Setting,
    camera: Camera,
}

/// One of the ways to draw it.
#[derive(Clone, Copy, Debug)]
struct Way {
    residency: Residency,
    n_strips: u8,
    overflow: Overflow,
    max_splats: MaxSplats,
    /// How much of the memory is fast, in 255ths; 0 for one region.
    fast_share: u8,
    skips_damage: bool,
}

type Drawn = Result<(Frame, FrameReport), DecodeError>;

impl Job<'_, '_> {
    /// Frames of the ways to draw without damage are the same.
    fn compare_ways<A: Arithmetic>(&self) {
        let way = self.streamed();
        let streamed = self.strict::<A>(way);
        let resident_way = Way { residency: Residency::Resident, ..way };
        let resident = self.strict::<A>(resident_way);
        if let (Ok(streamed), Ok(resident)) = (&streamed, &resident) {
            self.check_same(streamed, resident, "where anchors wait");
        }
        if self.setting.fast_share > 0 {
            for (way, whole) in [(way, &streamed), (resident_way, &resident)] {
                let split = self.strict::<A>(Way { fast_share: self.setting.fast_share, ..way });
                match (&split, whole) {
                    (Ok(split), Ok(whole)) => self.check_same(split, whole, "where memory lies"),
                    (split, whole) => assert_eq!(split.as_ref().err(), whole.as_ref().err(), "in two regions and one"),
                }
            }
        }
        if let (Ok((frame, report)), true) = (&streamed, self.setting.has_wide_boxes) {
            let whole = Way { n_strips: 1, overflow: Overflow::LeaveOut, max_splats: MaxSplats::Worst, ..way };
            let (whole, whole_report) = self.strict::<A>(whole).expect("a frame that draws in strips draws whole");
            if report.splats_dropped == 0 && whole_report.splats_dropped == 0 {
                assert!(*frame == whole, "{report:?} and whole {whole_report:?}: strips and slabs change nothing");
            }
        }
    }

    /// With damage left out a frame is what it is without damage, or says what is gone, wherever anchors wait.
    fn compare_with_damage_left_out(&self) {
        let way = self.streamed();
        let streamed = self.skipping(way);
        self.check_left_out(&self.strict::<ReferenceArithmetic>(way), &streamed, way);
        let is_bakeable = self.bundle.n_gaussians(0).is_some();
        let residency = match self.setting.residency {
            Residency::Baked if !is_bakeable => Residency::Resident,
            residency => residency,
        };
        let other_way = Way { residency, ..way };
        let other = self.skipping(other_way);
        self.check_left_out(&self.strict::<ReferenceArithmetic>(other_way), &other, other_way);
        match (&streamed, &other) {
            (Ok(streamed), Ok(other)) => self.check_same(streamed, other, "what is kept"),
            // The file says too few Gaussians.
            (_, Err(DecodeError::OutOfRange { field: Field::TierGaussians, .. })) => {}
            // A frame in slabs fails for a stream that is damaged behind a right checksum; whoever keeps its anchors knows it before.
            (Err(DecodeError::ChunkStream { .. }), Ok(_)) if way.overflow == Overflow::Slabs => {}
            (streamed, other) => {
                assert_eq!(streamed.as_ref().err(), other.as_ref().err(), "{way:?} and {other_way:?}");
            }
        }
    }

    fn streamed(&self) -> Way {
        let Setting { n_strips, overflow, max_splats, .. } = *self.setting;
        Way { residency: Residency::Streamed, n_strips, overflow, max_splats, fast_share: 0, skips_damage: false }
    }

    /// What two ways that differ in memory alone draw is the same. In slabs it need not be where a box lies, which one way looks at and
    /// another does not; nor where too many splats lie at one depth.
    fn check_same(
        &self,
        (frame, report): &(Frame, FrameReport),
        (other, other_report): &(Frame, FrameReport),
        why: &str,
    ) {
        if self.setting.overflow == Overflow::LeaveOut {
            let drawn = |report: &FrameReport| (report.splats, report.splats_dropped, report.first_damaged);
            assert_eq!(drawn(report), drawn(other_report), "{why} changes nothing");
            assert!(frame == other, "{report:?} and {other_report:?}: {why} changes nothing");
        } else if self.setting.has_wide_boxes && report.splats_dropped == 0 && other_report.splats_dropped == 0 {
            assert_eq!(report.first_damaged, other_report.first_damaged, "{why} changes nothing");
            assert!(frame == other, "{report:?} and {other_report:?}: {why} changes nothing");
        }
    }

    /// A frame with damage left out is the one without damage if there is none, and else says so.
    fn check_left_out(&self, strict: &Drawn, skipping: &Drawn, way: Way) {
        match (strict, skipping) {
            (Ok(strict), Ok(skipping)) => {
                let ((frame, report), (other, other_report)) = (strict, skipping);
                // Strips share passes in one of them alone, so that counts of work may differ.
                let drawn =
                    |r: &FrameReport| (r.splats, r.splats_dropped, r.max_splats, r.pixel_splats, r.chunks_damaged);
                assert_eq!(drawn(report), drawn(other_report), "without damage both draw the same");
                assert_eq!(other_report.chunks_damaged, 0, "nothing is left out in silence");
                assert!(frame == other, "without damage both draw the same");
            }
            (Err(DecodeError::ChunkStream { chunk, .. }), Ok((_, report))) if way.residency == Residency::Streamed => {
                assert!(report.first_damaged.is_some_and(|first| first <= *chunk), "{report:?} against chunk {chunk}");
                assert!(report.chunks_damaged > 0, "{report:?}");
            }
            // Checksums are compared, and chunks in memory decoded, when bound: the chunk may be out of view, where boxes say so.
            (
                Err(DecodeError::ChunkChecksum { chunk, .. } | DecodeError::ChunkStream { chunk, .. }),
                Ok((_, report)),
            ) => {
                let is_named = report.first_damaged.is_some_and(|first| first <= *chunk);
                let is_seen = self.setting.has_wide_boxes && way.residency == Residency::Streamed;
                assert!(is_named || !is_seen, "{report:?} against chunk {chunk}");
            }
            (Err(strict), Err(skipping)) => assert_eq!(strict.class(), skipping.class(), "{strict} against {skipping}"),
            (strict, skipping) => panic!("{:?} against {:?}", strict.as_ref().err(), skipping.as_ref().err()),
        }
    }

    fn plan(&self, way: Way) -> Result<Plan, DecodeError> {
        let budget = self
            .setting
            .budget(&self.camera)
            .with_residency(way.residency)
            .with_strips(Strips::Exactly(way.n_strips))
            .with_overflow(way.overflow)
            .with_max_splats(way.max_splats);
        let budget = if way.skips_damage { budget.skipping_damage() } else { budget };
        let whole = Plan::new(self.bundle, &budget)?;
        if way.fast_share == 0 {
            return Ok(whole);
        }
        let fast = whole.scratch_len() * usize::from(way.fast_share) / usize::from(u8::MAX);
        Plan::new(self.bundle, &budget.in_bytes(fast).with_slow_bytes(SLOW_BYTES))
    }

    /// Draws with damage left out.
    fn skipping(&self, way: Way) -> Drawn {
        self.strict::<ReferenceArithmetic>(Way { skips_damage: true, ..way })
    }

    /// Draws, without leave to leave damage out unless the way says so.
    fn strict<A: Arithmetic>(&self, way: Way) -> Drawn {
        let drawn = self.frame::<A>(way);
        if let Err(error) = &drawn {
            check_blame(error);
        }
        drawn
    }

    fn frame<A: Arithmetic>(&self, way: Way) -> Drawn {
        let plan = self.plan(way)?;
        let [mut fast, mut slow] = [plan.scratch_len(), plan.slow_scratch_len()].map(|len| vec![0xA5; len]);
        let mut decoder = Decoder::bind_in::<A>(self.bundle, plan, [&mut fast, &mut slow])?;
        let mut frame = Frame::new(self.camera.width_px, self.camera.height_px);
        let report = decoder.render(&self.camera, &mut frame)?;
        assert!(frame.deliveries.iter().all(|n| *n == 1), "every pixel comes once");
        Ok((frame, report))
    }
}

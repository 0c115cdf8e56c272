//! How a bundle is drawn, said by the bytes behind its file, which belong to nobody: bundles of the conformance pack have none, and a fuzzer
//! may append some.

use std::f32::consts::TAU;

use pocketsplat_core::{Budget, Bundle, Camera, MaxSplats, Overflow, Quality, Residency, Rotation, SectionKind};
use pocketsplat_format::bundle::{CHUNK_RECORD_LEN, InkFrame, TIER_RECORD_LEN};

use super::seal::reseal;

/// Bytes of a setting. Those that are missing are 0.
pub const LEN: usize = 46;

/// Where the header says where the file ends.
const FILE_LEN: usize = 12;
/// Frames are drawn no larger than this, pixels: what is looked for does not depend on it, the time does.
const MAX_FRAME_PX: u16 = 64;
/// Half of the edge of an ink box that nothing lies outside of.
const EVERYWHERE: f32 = 1e30;

/// How a bundle is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    /// Whether the frame is computed as without an FPU.
    pub(super) without_fpu: bool,
    /// Splats that there are places for.
    pub(super) max_splats: MaxSplats,
    /// Strips of the frame.
    pub(super) n_strips: u8,
    /// What becomes of splats without a place.
    pub(super) overflow: Overflow,
    /// Where anchors wait in the frame that is compared with the streamed one.
    pub(super) residency: Residency,
    /// How much of the memory is fast, in 255ths; 0 for one region.
    pub(super) fast_share: u8,
    /// Whether ink boxes are made to hold everything. Those of a hostile file may lie, and then show in pixels what was left out.
    pub(super) has_wide_boxes: bool,
    tiers: u8,
    quality: Quality,
    /// The number of a chunk and one, of which the checksum is wrong.
    broken_chunk: u8,
    size_px: [u8; 2],
    orbit: u8,
    pose: Option<Pose>,
}

/// A camera of any numbers.
#[derive(Clone, Copy, Debug)]
struct Pose {
    quaternion: [i8; 4],
    translation: [f32; 3],
    focal_px: [f32; 2],
    principal_px: [f32; 2],
}

/// Takes bytes from the front, and 0 after the last.
struct Tail<'a>(&'a [u8]);

impl Tail<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (front, rest) = self.0.split_at(self.0.len().min(N));
        self.0 = rest;
        let mut bytes = [0; N];
        bytes[..front.len()].copy_from_slice(front);
        bytes
    }

    fn byte(&mut self) -> u8 {
        let [byte] = self.bytes();
        byte
    }

    fn f32s<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| f32::from_le_bytes(self.bytes()))
    }
}

impl Setting {
    /// That of the bytes behind the file that `bytes` begins with.
    pub(super) fn behind(bytes: &[u8]) -> Self {
        let file_len = Tail(bytes.get(FILE_LEN..).unwrap_or_default()).bytes();
        let mut tail = Tail(bytes.get(u32::from_le_bytes(file_len) as usize..).unwrap_or_default());
        let flags = tail.byte();
        let has = |bit: u8| flags >> bit & 1 == 1;
        let n_strips = tail.byte() % 8 + 1;
        let [places, residency, fast_share, arithmetic, tiers, alpha_cut] = tail.bytes();
        let [_, _] = tail.bytes();
        let [broken_chunk, width, height, orbit] = tail.bytes();
        let pose = Pose {
            quaternion: tail.bytes::<4>().map(u8::cast_signed),
            translation: tail.f32s(),
            focal_px: tail.f32s(),
            principal_px: tail.f32s(),
        };
        Self {
            without_fpu: arithmetic % 2 == 1,
            max_splats: if places == 0 { MaxSplats::Worst } else { MaxSplats::AtMost(u32::from(places) + 1) },
            n_strips,
            overflow: if has(0) { Overflow::Slabs } else { Overflow::LeaveOut },
            residency: [Residency::Resident, Residency::Baked, Residency::Streamed, Residency::AutoWithSums]
                [usize::from(residency % 4)],
            fast_share,
            has_wide_boxes: has(1),
            tiers: if tiers == 0 { u8::MAX } else { tiers },
            quality: Quality { alpha_cut: alpha_cut % 64 + 1, detail: !has(2) },
            broken_chunk,
            size_px: [width, height],
            orbit,
            pose: has(3).then_some(pose),
        }
    }

    /// Makes checksums right, ink boxes and one checksum what the setting says; then the bundle, if it is one.
    pub(super) fn bundle<'b>(&self, bytes: &'b mut [u8]) -> Option<Bundle<'b>> {
        reseal(bytes);
        if self.has_wide_boxes {
            widen_boxes(bytes)?;
            reseal(bytes);
        }
        if let Some(at) = self.broken_chunk.checked_sub(1).and_then(|index| first_byte(bytes, index.into())) {
            bytes[at] ^= 1;
        }
        Bundle::parse(bytes).ok()
    }

    /// Frames that a frame is compared with are drawn by it too, but for what a way to draw it says.
    pub(super) fn budget(&self, camera: &Camera) -> Budget {
        Budget::for_frame(camera.width_px, camera.height_px)
            .with_max_splats(self.max_splats)
            .with_quality(self.quality)
            .with_tiers(self.tiers)
    }

    /// The camera: the preview's, or one of any numbers.
    pub(super) fn camera(&self, preview: &Camera) -> Camera {
        let [width_px, height_px] =
            [(self.size_px[0], preview.width_px), (self.size_px[1], preview.height_px)].map(|(set, preview)| {
                let px = if set == 0 { preview } else { u16::from(set) };
                px.min(MAX_FRAME_PX)
            });
        let camera = preview.resized(width_px, height_px).orbited(f32::from(self.orbit) * TAU / 256.0);
        let Some(pose) = self.pose else { return camera };
        let rotation = Rotation::new(pose.rotation()).unwrap_or(camera.rotation);
        let Pose { translation, focal_px, principal_px, .. } = pose;
        Camera { rotation, translation, focal_px, principal_px, ..camera }
    }
}

impl Pose {
    /// The matrix of the unit quaternion along its four numbers.
    fn rotation(&self) -> [f32; 9] {
        let numbers = self.quaternion.map(f32::from);
        let norm = numbers.iter().map(|n| n * n).sum::<f32>().sqrt().max(1.0);
        let [w, x, y, z] = numbers.map(|n| n / norm);
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ]
    }
}

/// Where a chunk that has bytes begins in the file.
fn first_byte(bytes: &[u8], chunk: u32) -> Option<usize> {
    let bundle = Bundle::parse(bytes).ok()?;
    let chunks = bundle.sections().find(|section| section.kind == SectionKind::Chunks)?;
    let chunk = bundle.chunk(chunk).ok().filter(|chunk| chunk.n_bytes() > 0)?;
    Some((chunks.offset + chunk.offset()) as usize)
}

/// Makes the ink box of each chunk hold everything.
fn widen_boxes(bytes: &mut [u8]) -> Option<()> {
    let bundle = Bundle::parse(bytes).ok()?;
    let directory = bundle.sections().find(|section| section.kind == SectionKind::Directory)?;
    let (start, len) = (directory.offset as usize, directory.len as usize);
    let tiers_len = usize::from(bundle.header().n_tiers) * TIER_RECORD_LEN;
    let (frame, records) = bytes.get_mut(start..start + len)?.get_mut(tiers_len..)?.split_first_chunk_mut()?;
    let step = 2.0 * EVERYWHERE / f32::from(u16::MAX);
    *frame = InkFrame { min: [-EVERYWHERE; 3], step: [step; 3] }.emit();
    for record in records.chunks_exact_mut(CHUNK_RECORD_LEN) {
        let (_, corners) = record.split_last_chunk_mut::<12>()?;
        corners[..6].fill(0);
        corners[6..].fill(u8::MAX);
    }
    Some(())
}

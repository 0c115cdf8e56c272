//! One photograph on its way into memory: decoded, composited, undistorted, reduced, cut.

use super::framing::Framing;
use super::image::read_composited;
use super::lens::is_scaling;
use super::listing::Shot;
use super::looks::Looks;
use super::mask_file::MaskFile;
use super::undistort::undistorted;
use super::{LoadOptions, Mask, Photograph, ViewFault};
use crate::camera::Camera;

/// A photograph that was read.
pub(super) struct Photo {
    pub(super) photograph: Photograph,
    /// Capture units.
    pub(super) camera: Camera,
    pub(super) looks: Looks,
    /// How many pixels of the file its masks leave out, where it has any.
    pub(super) n_masked_px: Option<u64>,
}

impl Shot {
    /// Decodes the photograph as the view of a pinhole camera in capture units.
    ///
    /// Composites on the background, undistorts at full resolution where the lens distorts, then reduces by area and cuts to
    /// the frame asked for; the camera and the mask follow.
    ///
    /// # Errors
    /// [`ViewFault::Unreadable`], [`ViewFault::Mask`] or [`ViewFault::Small`].
    pub(super) fn read(&self, options: &LoadOptions) -> Result<Photo, ViewFault> {
        let unreadable = |message| ViewFault::Unreadable { path: self.path.clone(), message };
        let (mut image, shown) = read_composited(&self.path, options.background).map_err(unreadable)?;
        let mut mask = self.read_masks()?;
        let n_masked_px = mask.as_ref().map(|mask| (mask.valid.len() - mask.n_valid()) as u64);
        if !self.lens.is_pinhole() {
            (image, mask) = undistorted(&image, mask.as_ref(), &self.lens);
        }
        let framing = self.framing(options)?;
        if framing.size_px != self.header.size_px {
            image = framing.image(&image);
            mask = mask.as_ref().map(|mask| framing.mask(mask));
        }
        if mask.as_ref().is_some_and(|mask| mask.n_valid() == 0) {
            let path = self.masks.first().map_or(&self.path, |mask| &mask.path).clone();
            return Err(ViewFault::Mask { path, message: "leaves no pixel of its image at this size".to_owned() });
        }
        let photograph = Photograph { image, mask };
        let looks = Looks::of(&photograph, shown);
        Ok(Photo { photograph, camera: self.camera(&framing), looks, n_masked_px })
    }

    /// At which size it is loaded, and which part of it.
    ///
    /// # Errors
    /// [`ViewFault::Small`].
    pub(super) fn framing(&self, options: &LoadOptions) -> Result<Framing, ViewFault> {
        Framing::of(self.header.size_px, options).ok_or_else(|| ViewFault::Small {
            path: self.path.clone(),
            found_px: self.header.size_px,
            needed_px: options.frame.map_or((0, 0), |frame| (frame.width_px, frame.height_px)),
        })
    }

    /// The camera of the photograph as it is loaded, capture units.
    pub(super) fn camera(&self, framing: &Framing) -> Camera {
        let camera = self.lens.camera(self.rotation, self.translation);
        if framing.size_px == self.header.size_px { camera } else { framing.camera(&camera) }
    }

    /// Bytes of the decoded photograph at most: undistorting may leave a mask, or leave none.
    pub(super) fn decoded_bytes(&self, options: &LoadOptions) -> u64 {
        let (width, height) = Framing::of(self.header.size_px, options).map_or((0, 0), |framing| framing.size_px);
        let may_have_mask = !self.masks.is_empty() || !self.lens.is_pinhole();
        u64::from(width) * u64::from(height) * if may_have_mask { 4 } else { 3 }
    }

    /// The pixels that count in all of its masks; `None` without masks.
    fn read_masks(&self) -> Result<Option<Mask>, ViewFault> {
        let masks = self.masks.iter().map(|file| self.read_mask(file));
        let both = |mut a: Mask, b: Mask| {
            a.valid.iter_mut().zip(b.valid).for_each(|(a, b)| *a &= b);
            a
        };
        Ok(masks.collect::<Result<Vec<_>, _>>()?.into_iter().reduce(both))
    }

    fn read_mask(&self, file: &MaskFile) -> Result<Mask, ViewFault> {
        let path = file.path.clone();
        let needed_px = self.header.size_px;
        match file.read() {
            Ok(mask) if (mask.width_px, mask.height_px) == needed_px => Ok(mask),
            // Masks are often kept at full size only.
            Ok(mask)
                if mask.width_px >= needed_px.0
                    && mask.height_px >= needed_px.1
                    && is_scaling((mask.width_px, mask.height_px), needed_px) =>
            {
                Ok(mask.area_resized(needed_px.0, needed_px.1))
            }
            Ok(mask) => {
                let (width_px, height_px) = (mask.width_px, mask.height_px);
                let message = format!("is {width_px}×{height_px} px, its image {}×{} px", needed_px.0, needed_px.1);
                Err(ViewFault::Mask { path, message })
            }
            Err(message) => Err(ViewFault::Mask { path, message }),
        }
    }
}

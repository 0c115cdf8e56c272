//! One photograph on its way into memory: decoded, composited, undistorted, reduced.

use super::image::{read_composited, read_mask};
use super::listing::Shot;
use super::undistort::undistorted;
use super::{LoadOptions, Mask, View, ViewFault};

impl Shot {
    /// Decodes the photograph as the view of a pinhole camera in capture units.
    ///
    /// Composites on the background, undistorts at full resolution where the lens distorts, then reduces by area; the
    /// camera and the mask follow.
    ///
    /// # Errors
    /// [`ViewFault::Unreadable`] or [`ViewFault::Mask`].
    pub(super) fn read(&self, name: &str, options: &LoadOptions) -> Result<View, ViewFault> {
        let unreadable = |message| ViewFault::Unreadable { path: self.path.clone(), message };
        let mut image = read_composited(&self.path, options.background).map_err(unreadable)?;
        let mut mask = self.read_mask()?;
        if !self.lens.is_pinhole() {
            (image, mask) = undistorted(&image, mask.as_ref(), &self.lens);
        }
        let mut camera = self.lens.camera(self.rotation, self.translation);
        let (source_width_px, source_height_px) = self.header.size_px;
        let (width_px, height_px) = options.loaded_size_px(source_width_px, source_height_px);
        if (width_px, height_px) != self.header.size_px {
            image = image.area_resized(width_px, height_px);
            mask = mask.map(|mask| mask.area_resized(width_px, height_px));
            camera = camera.resized(width_px, height_px);
        }
        Ok(View { name: name.to_owned(), camera, image, mask })
    }

    fn read_mask(&self) -> Result<Option<Mask>, ViewFault> {
        let Some(path) = self.mask.clone() else { return Ok(None) };
        let needed_px = self.header.size_px;
        match read_mask(&path) {
            Ok(mask) if (mask.width_px, mask.height_px) == needed_px => Ok(Some(mask)),
            Ok(mask) => {
                let (width_px, height_px) = (mask.width_px, mask.height_px);
                let message = format!("is {width_px}×{height_px} px, its image {}×{} px", needed_px.0, needed_px.1);
                Err(ViewFault::Mask { path, message })
            }
            Err(message) => Err(ViewFault::Mask { path, message }),
        }
    }
}

//! Frames of transforms files, whichever layout they belong to.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::image::{ImageHeader, read_header};
use super::lens::{Lens, Projection};
use super::listing::{ListedView, Listing, Note, Shot, unused_images};
use super::named_path::NamedPath;
use super::pose::world_to_camera;
use super::{DatasetError, Layout, Split, ViewFault};

mod json;

pub(super) use json::{Frame, Intrinsics, Transforms, read_transforms};

/// Camera models whose parameters the fields of a transforms file spell out.
const PERSPECTIVE_MODELS: [&str; 7] =
    ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE", FULL_MODEL];
const FISHEYE_MODELS: [&str; 3] = ["OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE"];
/// The model of which k4, k5 and k6 stand below the fraction.
const FULL_MODEL: &str = "FULL_OPENCV";

impl Transforms {
    /// Refuses a camera model of all frames that cannot be undistorted.
    ///
    /// # Errors
    /// [`DatasetError::CameraModel`].
    pub(super) fn check_model(&self, path: &Path) -> Result<(), DatasetError> {
        match unknown_model(&self.shared) {
            Some(model) => {
                Err(DatasetError::CameraModel { path: path.to_owned(), camera: "all frames".to_owned(), model })
            }
            None => Ok(()),
        }
    }

    /// The first part that all frames' paths share, such as `images`.
    pub(super) fn image_folder(&self) -> Option<&str> {
        let mut folders = self.frames.iter().map(|frame| frame.path().first_folder());
        let first = folders.next()??;
        folders.all(|folder| folder == Some(first)).then_some(first)
    }
}

/// Lists frames of a layout that brings neither points nor a list of splits, in their order.
///
/// * `source`: what lists the frames; `images`: the folder that their paths start from.
/// * `split`: of the frame at a place; none leaves it out.
pub(super) fn list_frames(
    layout: Layout,
    source: PathBuf,
    images: &Path,
    frames: &[Frame],
    shared: &Intrinsics,
    split: impl Fn(usize) -> Option<Split> + Sync,
) -> Listing {
    let view = |(i, frame): (usize, &Frame)| {
        Some(ListedView { split: split(i)?, name: frame.name().to_owned(), shot: frame.shot(images, None, shared) })
    };
    let views: Vec<ListedView> = frames.par_iter().enumerate().filter_map(view).collect();
    let found: Vec<PathBuf> = frames.iter().filter_map(|frame| frame.image(images, None)).collect();
    let unposed = unused_images(images, found.iter().map(PathBuf::as_path));
    let text = "the capture brings no points, so training starts from random points where the cameras look";
    let mut listing =
        Listing { layout, source, views, points: None, unposed, notes: vec![Note::new("no-points", text)] };
    if !listing.has_test_views() {
        listing.notes.push(Note::no_test_views());
    }
    listing
}

impl Frame {
    /// The frame's photograph.
    ///
    /// * `images`: a folder that stands in for the first part of the frame's path.
    ///
    /// # Errors
    /// [`ViewFault`] says why the frame cannot be used.
    pub(super) fn shot(&self, folder: &Path, images: Option<&str>, shared: &Intrinsics) -> Result<Shot, ViewFault> {
        let (rotation, translation) = world_to_camera(&self.rows())?;
        if let Some(model) = unknown_model(&self.own) {
            return Err(ViewFault::CameraModel { model });
        }
        let path = self.image(folder, images).ok_or_else(|| ViewFault::Missing {
            path: self.path().expected(folder, images),
            listed_in: "the transforms file",
        })?;
        let header = match read_header(&path) {
            Ok(header) => header,
            Err(message) => return Err(ViewFault::of_header(path, message)),
        };
        let lens = self.lens(&path, &header, shared)?;
        let mask = match self.mask_path.as_deref().map(NamedPath::new) {
            Some(named) => Some(named.mask(folder).ok_or_else(|| ViewFault::Mask {
                path: named.expected(folder, None),
                message: "does not exist".to_owned(),
            })?),
            None => None,
        };
        Ok(Shot { path, header, rotation, translation, lens, mask })
    }

    /// The frame's image file, where it is there; `images` as for [`Self::shot`].
    pub(super) fn image(&self, folder: &Path, images: Option<&str>) -> Option<PathBuf> {
        self.path().image(folder, images)
    }

    /// The frame's mask, where it names one that is there.
    pub(super) fn mask(&self, folder: &Path) -> Option<PathBuf> {
        NamedPath::new(self.mask_path.as_deref()?).mask(folder)
    }

    /// The lens for the image as it is stored: the frame's own numbers before the shared ones, the focal length before
    /// the field of view, the middle of the image where no principal point is given.
    fn lens(&self, path: &Path, header: &ImageHeader, shared: &Intrinsics) -> Result<Lens, ViewFault> {
        let either = |number: fn(&Intrinsics) -> Option<f64>| number(&self.own).or_else(|| number(shared));
        let size_px = match (either(|i| i.w), either(|i| i.h)) {
            (Some(w), Some(h)) => {
                // Not whole, or out of range: 0, which `fault` refuses.
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked on this line")]
                let whole = |side: f64| if side.fract() == 0.0 && (1.0..1e6).contains(&side) { side as u32 } else { 0 };
                (whole(w), whole(h))
            }
            _ => header.size_px,
        };
        let focal = |i: &Intrinsics| {
            let of = |angle: f64, side_px: u32| 0.5 * f64::from(side_px) / (0.5 * angle).tan();
            let x = i.fl_x.or_else(|| i.camera_angle_x.map(|angle| of(angle, size_px.0)))?;
            let from_angle = || i.camera_angle_y.filter(|_| i.fl_x.is_none()).map(|angle| of(angle, size_px.1));
            Some([x, i.fl_y.or_else(from_angle).unwrap_or(x)])
        };
        let focal_px = focal(&self.own).or_else(|| focal(shared)).unwrap_or([f64::NAN; 2]);
        let central = Lens::central(size_px, focal_px);
        let lens = Lens {
            principal_px: [
                either(|i| i.cx).unwrap_or(central.principal_px[0]),
                either(|i| i.cy).unwrap_or(central.principal_px[1]),
            ],
            radial: [either(|i| i.k1), either(|i| i.k2), either(|i| i.k3), either(|i| i.k4)]
                .map(Option::unwrap_or_default),
            tangential: [either(|i| i.p1), either(|i| i.p2)].map(Option::unwrap_or_default),
            ..central
        };
        let model = |i: &Intrinsics| i.camera_model.as_deref().map(str::to_ascii_uppercase);
        let model = model(&self.own).or_else(|| model(shared));
        let is_fisheye = match model.as_deref() {
            Some(model) => FISHEYE_MODELS.contains(&model),
            None => self.own.is_fisheye.or(shared.is_fisheye) == Some(true),
        };
        let lens = if is_fisheye {
            Lens { projection: Projection::Fisheye, tangential: [0.0; 2], ..lens }
        } else if model.as_deref() == Some(FULL_MODEL) {
            let [k1, k2, k3, k4] = lens.radial;
            let below = [either(|i| i.k5), either(|i| i.k6)].map(Option::unwrap_or_default);
            Lens { radial: [k1, k2, k3, 0.0], divisor: [k4, below[0], below[1]], ..lens }
        } else {
            lens
        };
        lens.for_image(path, header.size_px)
    }
}

/// The name of a camera model whose distortion the fields do not spell out.
fn unknown_model(intrinsics: &Intrinsics) -> Option<String> {
    let model = intrinsics.camera_model.as_deref()?;
    let known = model.to_ascii_uppercase();
    let mut all = PERSPECTIVE_MODELS.iter().chain(&FISHEYE_MODELS);
    (!all.any(|model| *model == known)).then(|| model.to_owned())
}

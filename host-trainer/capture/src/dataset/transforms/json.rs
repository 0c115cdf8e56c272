//! Transforms files: JSON with intrinsics, for all frames or for each, and one pose per frame.

use std::path::Path;

use glam::{DMat3, DVec3};
use serde::Deserialize;

use crate::dataset::named_path::NamedPath;
use crate::dataset::{DatasetError, non_finite, text_file};

/// What a transforms file holds, as far as it is used.
pub(in crate::dataset) struct Transforms {
    /// Of all frames that give none of their own.
    pub(in crate::dataset) shared: Intrinsics,
    pub(in crate::dataset) frames: Vec<Frame>,
    /// A point cloud, relative to the capture.
    pub(in crate::dataset) ply_file_path: Option<String>,
    /// `train_filenames`, `val_filenames`, `test_filenames`.
    pub(in crate::dataset) splits: [Option<Vec<String>>; 3],
}

/// The numbers of a camera, each for all frames or for one; a number that is none counts as not given.
#[derive(Clone, Default, Deserialize)]
#[serde(default)]
pub(in crate::dataset) struct Intrinsics {
    /// Fields of view, radians.
    pub(in crate::dataset) camera_angle_x: Option<f64>,
    pub(in crate::dataset) camera_angle_y: Option<f64>,
    /// Focal lengths and principal point, pixels.
    pub(in crate::dataset) fl_x: Option<f64>,
    pub(in crate::dataset) fl_y: Option<f64>,
    pub(in crate::dataset) cx: Option<f64>,
    pub(in crate::dataset) cy: Option<f64>,
    /// The image size they are for, pixels; written as floats by some.
    pub(in crate::dataset) w: Option<f64>,
    pub(in crate::dataset) h: Option<f64>,
    pub(in crate::dataset) k1: Option<f64>,
    pub(in crate::dataset) k2: Option<f64>,
    pub(in crate::dataset) k3: Option<f64>,
    pub(in crate::dataset) k4: Option<f64>,
    pub(in crate::dataset) k5: Option<f64>,
    pub(in crate::dataset) k6: Option<f64>,
    pub(in crate::dataset) p1: Option<f64>,
    pub(in crate::dataset) p2: Option<f64>,
    pub(in crate::dataset) camera_model: Option<String>,
    pub(in crate::dataset) is_fisheye: Option<bool>,
}

/// The rest of the file, read apart from the shared intrinsics so that an error in these tells its own column.
#[derive(Deserialize)]
struct Contents {
    frames: Vec<Frame>,
    ply_file_path: Option<String>,
    train_filenames: Option<Vec<String>>,
    val_filenames: Option<Vec<String>>,
    test_filenames: Option<Vec<String>>,
}

/// One photograph.
#[derive(Deserialize)]
pub(in crate::dataset) struct Frame {
    /// Relative to the capture, in Blender captures usually without extension.
    file_path: String,
    /// [`NamedPath::name`] of it.
    #[serde(skip)]
    name: String,
    /// Camera to world, OpenGL axes; `null` stands for a number that is none.
    transform_matrix: Vec<Vec<Option<f64>>>,
    /// An image whose black pixels do not count.
    pub(super) mask_path: Option<String>,
    #[serde(flatten)]
    pub(super) own: Intrinsics,
}

impl Frame {
    /// A frame of another file: the path of its image, its matrix by rows and its lens.
    pub(in crate::dataset) fn new(file_path: String, rows: &[Vec<f64>], own: Intrinsics) -> Self {
        let name = NamedPath::new(&file_path).name();
        let transform_matrix = rows.iter().map(|row| row.iter().copied().map(Some).collect()).collect();
        Self { file_path, name, transform_matrix, mask_path: None, own }
    }

    /// The same of a matrix in OpenCV's axes: y and z turn.
    pub(in crate::dataset) fn of_opencv(file_path: String, mut rows: Vec<Vec<f64>>, own: Intrinsics) -> Self {
        for row in rows.iter_mut().take(3) {
            row.iter_mut().skip(1).take(2).for_each(|number| *number = -*number);
        }
        Self::new(file_path, &rows, own)
    }

    /// The same of the rotation from camera to world, OpenGL axes, and of the camera's place.
    pub(in crate::dataset) fn of_pose(file_path: String, to_world: DMat3, centre: DVec3, own: Intrinsics) -> Self {
        let row = |i: usize| to_world.row(i).to_array().into_iter().chain([centre[i]]).collect();
        Self::new(file_path, &[row(0), row(1), row(2)], own)
    }

    /// The path of the image as the file gives it.
    pub(in crate::dataset) fn path(&self) -> NamedPath<'_> {
        NamedPath::new(&self.file_path)
    }

    /// The path as people write it.
    pub(in crate::dataset) fn name(&self) -> &str {
        &self.name
    }

    /// The matrix by rows; numbers that are none are NaN.
    pub(super) fn rows(&self) -> Vec<Vec<f64>> {
        self.transform_matrix.iter().map(|row| row.iter().map(|x| x.unwrap_or(f64::NAN)).collect()).collect()
    }
}

/// Reads and checks a transforms file.
///
/// # Errors
/// [`DatasetError::Read`], [`DatasetError::Transforms`], [`DatasetError::FieldOfView`] or [`DatasetError::NoFocal`],
/// naming the file.
pub(in crate::dataset) fn read_transforms(path: &Path) -> Result<Transforms, DatasetError> {
    let text = text_file::read(path)?;
    let transforms = non_finite::read(&text, parse).map_err(|source| DatasetError::of_transforms(path, source))?;
    let angle = transforms.shared.camera_angle_x;
    if let Some(found) = angle.filter(|&angle| !(angle > 0.0 && angle < std::f64::consts::PI)) {
        return Err(DatasetError::FieldOfView { path: path.to_owned(), found });
    }
    let has_focal = |i: &Intrinsics| [i.fl_x, i.fl_y, i.camera_angle_x, i.camera_angle_y].iter().any(Option::is_some);
    if !has_focal(&transforms.shared)
        && let Some(frame) = transforms.frames.iter().find(|frame| !has_focal(&frame.own))
    {
        return Err(DatasetError::NoFocal { path: path.to_owned(), frame: frame.name().to_owned() });
    }
    Ok(transforms)
}

fn parse(text: &str) -> serde_json::Result<Transforms> {
    let shared = serde_json::from_str(text)?;
    let contents: Contents = serde_json::from_str(text)?;
    let Contents { mut frames, ply_file_path, train_filenames, val_filenames, test_filenames } = contents;
    frames.iter_mut().for_each(|frame| frame.name = frame.path().name());
    Ok(Transforms { shared, frames, ply_file_path, splits: [train_filenames, val_filenames, test_filenames] })
}

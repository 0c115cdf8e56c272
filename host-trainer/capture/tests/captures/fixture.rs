//! Small captures written to temporary folders: cameras on an arc around the origin, images of a few pixels.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use pocketsplat_capture::dataset::{Capture, DatasetError, LoadOptions, LoadReport, Photograph, View, load};
use tempfile::TempDir;

/// Width and height of the images, pixels.
pub(crate) const SIZE_PX: (u32, u32) = (24, 16);
/// Focal length, pixels.
pub(crate) const FOCAL_PX: f64 = 20.0;

/// How a capture is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Blender,
    ColmapBinary,
    ColmapText,
    Nerfstudio,
}

/// A camera of the model, as COLMAP writes it.
#[derive(Clone)]
pub(crate) struct Camera {
    pub(crate) id: u32,
    /// Number and name.
    pub(crate) model: (u32, &'static str),
    pub(crate) size_px: (u64, u64),
    pub(crate) parameters: Vec<f64>,
}

/// A posed image.
#[derive(Clone)]
pub(crate) struct Photo {
    pub(crate) name: String,
    /// Camera to world, OpenCV axes.
    pub(crate) rotation: DMat3,
    pub(crate) centre: DVec3,
    pub(crate) camera_id: u32,
    /// Length of the quaternion written.
    pub(crate) quaternion_length: f64,
    /// Fields added to the frame of a transforms file.
    pub(crate) extra: String,
}

/// A capture before it is written; tests change it and then write it.
pub(crate) struct Fixture {
    folder: TempDir,
    pub(crate) kind: Kind,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) photos: Vec<Photo>,
    pub(crate) points: Vec<DVec3>,
    /// Fields of a transforms file, for all frames.
    pub(crate) shared: String,
}

/// The photograph of a view that was just loaded.
pub(crate) fn photograph(view: &View) -> Arc<Photograph> {
    view.photograph().expect("a photograph")
}

impl Fixture {
    /// A capture of `n` photographs `images/p_00.png`, …, with their images written.
    pub(crate) fn new(kind: Kind, n: usize) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (width_px, height_px) = SIZE_PX;
        let centre = [0.5 * f64::from(width_px), 0.5 * f64::from(height_px)];
        let photos = (0..n).map(|i| photo(i, DVec3::ZERO)).collect();
        let shared = match kind {
            Kind::Blender => format!("\"camera_angle_x\": {:?}", 2.0 * (centre[0] / FOCAL_PX).atan()),
            _ => format!("\"fl_x\": {FOCAL_PX}, \"fl_y\": {FOCAL_PX}, \"w\": {width_px}.0, \"h\": {height_px}"),
        };
        let fixture = Self {
            kind,
            cameras: vec![Camera {
                id: 1,
                model: (1, "PINHOLE"),
                size_px: (u64::from(width_px), u64::from(height_px)),
                parameters: vec![FOCAL_PX, FOCAL_PX, centre[0], centre[1]],
            }],
            photos,
            points: (0..20).map(|i| DVec3::new(0.1 * f64::from(i) - 1.0, 0.2, 0.05 * f64::from(i % 3))).collect(),
            shared,
            folder,
        };
        fs::create_dir(fixture.path().join("images")).expect("a folder for images");
        fixture.photos.iter().for_each(|photo| fixture.write_image(&format!("images/{}", photo.name), SIZE_PX));
        fixture
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    /// Writes a file, making its folder where it is missing.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.at(name);
        fs::create_dir_all(path.parent().expect("a file lies in a folder")).expect("a folder");
        fs::write(path, bytes).expect("a file");
    }

    pub(crate) fn remove(&self, name: &str) {
        fs::remove_file(self.at(name)).expect("it was written");
    }

    /// Writes an image of a gradient that depends on the position alone, RGBA for Blender captures.
    pub(crate) fn write_image(&self, name: &str, (width_px, height_px): (u32, u32)) {
        let (path, has_alpha) = (self.at(name), self.kind == Kind::Blender);
        let pixels =
            (0..height_px).flat_map(|y| (0..width_px).map(move |x| [x * 255 / width_px, y * 255 / height_px, 90]));
        let bytes: Vec<u8> = pixels
            .flat_map(|rgb| rgb.map(|v| v as u8).into_iter().chain(has_alpha.then_some(200)).collect::<Vec<_>>())
            .collect();
        let colour = if has_alpha { image::ExtendedColorType::Rgba8 } else { image::ExtendedColorType::Rgb8 };
        fs::create_dir_all(path.parent().expect("a file lies in a folder")).expect("a folder");
        image::save_buffer(path, &bytes, width_px, height_px, colour).expect("an image");
    }

    /// Writes a mask whose left third does not count.
    pub(crate) fn write_mask(&self, name: &str, (width_px, height_px): (u32, u32)) {
        let path = self.at(name);
        fs::create_dir_all(path.parent().expect("a file lies in a folder")).expect("a folder");
        let value = |x: u32, _| image::Luma([if 3 * x < width_px { 0 } else { 255_u8 }]);
        image::ImageBuffer::from_fn(width_px, height_px, value).save(path).expect("an image");
    }

    /// The files of the layout that hold poses, as path and bytes.
    pub(crate) fn files(&self) -> Vec<(&'static str, Vec<u8>)> {
        match self.kind {
            Kind::ColmapBinary => vec![
                ("sparse/0/cameras.bin", self.cameras_bin()),
                ("sparse/0/images.bin", self.images_bin()),
                ("sparse/0/points3D.bin", self.points_bin()),
            ],
            Kind::ColmapText => vec![
                ("sparse/0/cameras.txt", self.cameras_txt().into_bytes()),
                ("sparse/0/images.txt", self.images_txt().into_bytes()),
                ("sparse/0/points3D.txt", self.points_txt().into_bytes()),
            ],
            Kind::Nerfstudio => vec![("transforms.json", self.transforms(&self.photos).into_bytes())],
            Kind::Blender => {
                let (test, train): (Vec<_>, Vec<_>) =
                    self.photos.iter().cloned().enumerate().partition(|(i, _)| i.is_multiple_of(8));
                let text = |photos: Vec<(usize, Photo)>| {
                    self.transforms(&photos.into_iter().map(|(_, photo)| photo).collect::<Vec<_>>()).into_bytes()
                };
                vec![("transforms_train.json", text(train)), ("transforms_test.json", text(test))]
            }
        }
    }

    pub(crate) fn write_files(&self) -> &Self {
        self.files().into_iter().for_each(|(name, bytes)| self.write(name, bytes));
        self
    }

    pub(crate) fn load_with(&self, options: &LoadOptions) -> Result<(Capture, LoadReport), DatasetError> {
        load(self.path(), options)
    }

    pub(crate) fn load(&self) -> Result<(Capture, LoadReport), DatasetError> {
        self.load_with(&LoadOptions::default())
    }

    fn transforms(&self, photos: &[Photo]) -> String {
        let frames: Vec<String> = photos.iter().map(frame).collect();
        format!("{{{}, \"frames\": [\n{}\n]}}", self.shared, frames.join(",\n"))
    }

    fn cameras_bin(&self) -> Vec<u8> {
        let mut bytes = (self.cameras.len() as u64).to_le_bytes().to_vec();
        for camera in &self.cameras {
            bytes.extend(camera.id.to_le_bytes());
            bytes.extend(camera.model.0.to_le_bytes());
            bytes.extend(camera.size_px.0.to_le_bytes());
            bytes.extend(camera.size_px.1.to_le_bytes());
            camera.parameters.iter().for_each(|p| bytes.extend(p.to_le_bytes()));
        }
        bytes
    }

    fn cameras_txt(&self) -> String {
        let line = |camera: &Camera| {
            let parameters: Vec<String> = camera.parameters.iter().map(|p| format!("{p:?}")).collect();
            let (width_px, height_px) = camera.size_px;
            format!("{} {} {width_px} {height_px} {}\n", camera.id, camera.model.1, parameters.join(" "))
        };
        format!("# Camera list\n{}", self.cameras.iter().map(line).collect::<String>())
    }

    fn images_bin(&self) -> Vec<u8> {
        let mut bytes = (self.photos.len() as u64).to_le_bytes().to_vec();
        for (i, photo) in self.photos.iter().enumerate() {
            bytes.extend((i as u32 + 1).to_le_bytes());
            pose(photo).iter().for_each(|number| bytes.extend(number.to_le_bytes()));
            bytes.extend(photo.camera_id.to_le_bytes());
            bytes.extend(photo.name.as_bytes());
            bytes.push(0);
            // Two observations of no point.
            bytes.extend(2_u64.to_le_bytes());
            bytes.extend([7; 48]);
        }
        bytes
    }

    fn images_txt(&self) -> String {
        let line = |(i, photo): (usize, &Photo)| {
            let numbers: Vec<String> = pose(photo).iter().map(|number| format!("{number:?}")).collect();
            // Every second image has no observations: an empty line.
            let observations = if i.is_multiple_of(2) { "1.5 2.5 -1 3.5 4.5 0" } else { "" };
            format!("{} {} {} {}\n{observations}\n", i + 1, numbers.join(" "), photo.camera_id, photo.name)
        };
        format!("# Image list\n{}", self.photos.iter().enumerate().map(line).collect::<String>())
    }

    fn points_bin(&self) -> Vec<u8> {
        let mut bytes = (self.points.len() as u64).to_le_bytes().to_vec();
        for (i, point) in self.points.iter().enumerate() {
            bytes.extend((i as u64).to_le_bytes());
            point.to_array().iter().for_each(|c| bytes.extend(c.to_le_bytes()));
            bytes.extend([200, 100, 50]);
            bytes.extend(0.5_f64.to_le_bytes());
            // A track of one element.
            bytes.extend(1_u64.to_le_bytes());
            bytes.extend([1; 8]);
        }
        bytes
    }

    fn points_txt(&self) -> String {
        let line = |(i, p): (usize, &DVec3)| format!("{i} {:?} {:?} {:?} 200 100 50 0.5 1 1\n", p.x, p.y, p.z);
        format!("# 3D point list\n\n{}", self.points.iter().enumerate().map(line).collect::<String>())
    }
}

/// Photograph `i` of the arc: radius 4 around `target`, looking at it.
pub(crate) fn photo(i: usize, target: DVec3) -> Photo {
    let rotation = DMat3::from_rotation_y(0.3 * i as f64) * DMat3::from_rotation_x(-0.2);
    Photo {
        name: format!("p_{i:02}.png"),
        rotation,
        centre: target + rotation * DVec3::new(0.0, 0.0, -4.0),
        camera_id: 1,
        quaternion_length: 1.0,
        extra: String::new(),
    }
}

/// `QW QX QY QZ TX TY TZ`, world to camera.
fn pose(photo: &Photo) -> [f64; 7] {
    let world_to_camera = photo.rotation.transpose();
    let q = DQuat::from_mat3(&world_to_camera) * photo.quaternion_length;
    let t = -(world_to_camera * photo.centre);
    [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
}

/// A frame of a transforms file: camera to world, OpenGL axes.
fn frame(photo: &Photo) -> String {
    let opengl = photo.rotation * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let rows = opengl.transpose().to_cols_array_2d();
    let row = |i: usize| format!("[{:?}, {:?}, {:?}, {:?}]", rows[i][0], rows[i][1], rows[i][2], photo.centre[i]);
    format!(
        "{{\"file_path\": \"./images/{}\", {}\"transform_matrix\": [{}, {}, {}, [0, 0, 0, 1]]}}",
        photo.name,
        photo.extra,
        row(0),
        row(1),
        row(2)
    )
}

//! What COLMAP's mapper leaves: models in numbered folders, of which the largest is kept as `sparse/0`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use pocketsplat_capture::dataset::MAX_FOCAL_RATIO;

/// A model of some of the photographs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Model {
    pub(super) folder: PathBuf,
    /// The photographs that have a pose in it, sorted.
    pub(super) names: Vec<String>,
    pub(super) n_points: usize,
    /// Mean over its points, pixels; none without points.
    pub(super) error_px: Option<f64>,
    /// The longer focal length of a camera over the shorter, where it is largest.
    pub(super) focal_ratio: f64,
}

impl Model {
    fn read(folder: &Path) -> Result<Self> {
        let bytes = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).with_context(|| format!("could not read {}", path.display()))
        };
        let cut = || format!("the model in {} is cut; give the same command with --overwrite", folder.display());
        let mut names = names_in(&bytes("images.bin")?).with_context(cut)?;
        names.sort_unstable();
        let errors = errors_in(&bytes("points3D.bin")?).with_context(cut)?;
        let error_px = (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64);
        let focal_ratio = focal_ratio_in(&bytes("cameras.bin")?).with_context(cut)?;
        Ok(Self { folder: folder.to_owned(), names, n_points: errors.len(), error_px, focal_ratio })
    }

    /// Whether its lenses are such as are made.
    pub(super) fn has_square_pixels(&self) -> bool {
        self.focal_ratio <= MAX_FOCAL_RATIO
    }
}

/// The models in a folder, the one with the most photographs first; those of more points first where these are as many.
pub(super) fn models_in(folder: &Path) -> Result<Vec<Model>> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut models = entries
        .filter(|path| path.join("images.bin").is_file())
        .map(|path| Model::read(&path))
        .collect::<Result<Vec<_>>>()?;
    models.sort_by(|a, b| (b.names.len(), b.n_points, &a.folder).cmp(&(a.names.len(), a.n_points, &b.folder)));
    Ok(models)
}

/// Moves models to `sparse/0`, `sparse/1` and so on, in their order.
pub(super) fn keep(models: &[Model], sparse: &Path) -> Result<()> {
    let moved = || -> std::io::Result<()> {
        fs::create_dir_all(sparse)?;
        models.iter().enumerate().try_for_each(|(i, model)| fs::rename(&model.folder, sparse.join(i.to_string())))
    };
    moved().with_context(|| format!("could not move the models to {}", sparse.display()))
}

/// Bytes that are read from the front.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }

    fn count(&mut self) -> Option<usize> {
        let bytes = self.take(8)?.try_into().ok()?;
        usize::try_from(u64::from_le_bytes(bytes)).ok()
    }

    fn float(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn name(&mut self) -> Option<String> {
        let n = self.0.iter().position(|&byte| byte == 0)?;
        let name = String::from_utf8_lossy(self.take(n)?).into_owned();
        self.take(1)?;
        Some(name)
    }
}

/// The names in `images.bin`: a count; of each image a number (4 bytes), rotation and translation (7 floats), the camera (4 bytes),
/// its name, ended by 0, and its features, counted (24 bytes each).
fn names_in(bytes: &[u8]) -> Option<Vec<String>> {
    let mut bytes = Bytes(bytes);
    let n = bytes.count()?;
    let image = |_| {
        bytes.take(4 + 7 * 8 + 4)?;
        let name = bytes.name()?;
        let n_features = bytes.count()?;
        bytes.take(n_features.checked_mul(24)?)?;
        Some(name)
    };
    (0..n).map(image).collect()
}

/// The errors of reprojection in `points3D.bin`, pixels: a count; of each point a number (8 bytes), place (3 floats), colour (3 bytes),
/// its error, and where it is seen, counted (8 bytes each).
fn errors_in(bytes: &[u8]) -> Option<Vec<f64>> {
    let mut bytes = Bytes(bytes);
    let n = bytes.count()?;
    let point = |_| {
        bytes.take(8 + 3 * 8 + 3)?;
        let error = bytes.float()?;
        let n_seen = bytes.count()?;
        bytes.take(n_seen.checked_mul(8)?)?;
        Some(error)
    };
    (0..n).map(point).collect()
}

/// The largest quotient of two focal lengths in `cameras.bin`: a count; of each camera a number and its model (4 bytes each), width and
/// height (8 bytes each), and its parameters: four of SIMPLE_RADIAL, whose focal length is one, and eight of OPENCV, two focal lengths first.
fn focal_ratio_in(bytes: &[u8]) -> Option<f64> {
    const SIMPLE_RADIAL: u32 = 2;
    const OPENCV: u32 = 4;
    let mut bytes = Bytes(bytes);
    let n = bytes.count()?;
    let camera = |_| {
        bytes.take(4)?;
        let model = u32::from_le_bytes(bytes.take(4)?.try_into().ok()?);
        bytes.take(2 * 8)?;
        let first = bytes.float()?;
        match model {
            SIMPLE_RADIAL => bytes.take(3 * 8).map(|_| 1.0),
            OPENCV => {
                let second = bytes.float()?;
                bytes.take(6 * 8)?;
                Some((first / second).max(second / first))
            }
            _ => None,
        }
    };
    (0..n).map(camera).try_fold(1.0, |most: f64, ratio| Some(most.max(ratio?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A model as COLMAP writes it, of one lens for some photographs and one for each of the others.
    fn write(folder: &Path, names: &[&str], errors: &[f64]) {
        fs::create_dir_all(folder).unwrap();
        let mut cameras = 2_u64.to_le_bytes().to_vec();
        for (number, model, parameters) in
            [(1_u32, 2_u32, &[90.0, 12.0, 8.0, 0.1][..]), (2, 4, &[90.0, 99.0, 12.0, 8.0, 0.1, 0.0, 0.0, 0.0])]
        {
            cameras.extend([number.to_le_bytes(), model.to_le_bytes()].concat());
            cameras.extend([24_u64.to_le_bytes(), 16_u64.to_le_bytes()].concat());
            cameras.extend(parameters.iter().flat_map(|value: &f64| value.to_le_bytes()));
        }
        fs::write(folder.join("cameras.bin"), cameras).unwrap();
        let mut images = (names.len() as u64).to_le_bytes().to_vec();
        for name in names {
            images.extend([0; 4 + 7 * 8 + 4]);
            images.extend(name.as_bytes());
            images.push(0);
            images.extend(2_u64.to_le_bytes());
            images.extend([0; 2 * 24]);
        }
        let mut points = (errors.len() as u64).to_le_bytes().to_vec();
        for error in errors {
            points.extend([0; 8 + 3 * 8 + 3]);
            points.extend(error.to_le_bytes());
            points.extend(3_u64.to_le_bytes());
            points.extend([0; 3 * 8]);
        }
        fs::write(folder.join("images.bin"), images).unwrap();
        fs::write(folder.join("points3D.bin"), points).unwrap();
    }

    #[test]
    fn the_largest_model_comes_first_and_lies_in_sparse_0() {
        let home = tempfile::tempdir().unwrap();
        let (models, sparse) = (home.path().join("models"), home.path().join("sparse"));
        write(&models.join("0"), &["b.jpg"], &[]);
        write(&models.join("1"), &["c.jpg", "a.jpg"], &[0.5, 1.0]);
        write(&models.join("2"), &["d.jpg"], &[1.0]);
        fs::create_dir(models.join("3")).unwrap();
        let found = models_in(&models).unwrap();
        let sizes: Vec<_> = found.iter().map(|model| (model.names.len(), model.n_points, model.error_px)).collect();
        assert_eq!(sizes, [(2, 2, Some(0.75)), (1, 1, Some(1.0)), (1, 0, None)]);
        assert_eq!(found[0].names, ["a.jpg", "c.jpg"]);
        assert!((found[0].focal_ratio - 1.1).abs() < 1e-9 && !found[0].has_square_pixels());
        keep(&found, &sparse).unwrap();
        assert_eq!(models_in(&sparse).unwrap()[0].folder, sparse.join("0"));
        let whole = fs::read(sparse.join("0/images.bin")).unwrap();
        fs::write(sparse.join("0/images.bin"), &whole[..whole.len() - 1]).unwrap();
        assert!(models_in(&sparse).unwrap_err().to_string().contains("is cut"));
    }
}

//! What COLMAP's mapper leaves: models in numbered folders, of which the largest is kept as `sparse/0`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use pocketsplat_capture::dataset::{
    MAX_FOCAL_RATIO, colmap_focal_lengths_px, colmap_posed_names, colmap_reprojection_errors_px,
};

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
        let mut names = colmap_posed_names(&bytes("images.bin")?).with_context(cut)?;
        names.sort_unstable();
        let errors = colmap_reprojection_errors_px(&bytes("points3D.bin")?).with_context(cut)?;
        let error_px = (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64);
        let focal_px = colmap_focal_lengths_px(&bytes("cameras.bin")?).with_context(cut)?;
        let focal_ratio = focal_px.iter().map(|[x, y]| (x / y).max(y / x)).fold(1.0, f64::max);
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

//! The capture of the run at hand, loaded once for all runs that share it.

use std::path::PathBuf;

use anyhow::Result;
use pocketsplat_capture::dataset::{Capture, PointsOrigin};

use super::{process, train};
use crate::config::RunConfig;

/// One capture, and the configuration that it was loaded for.
#[derive(Default)]
pub(super) struct LoadedCapture {
    loaded: Option<(RunConfig, Capture)>,
    /// Folder for what is made of the capture.
    run: Option<PathBuf>,
}

impl LoadedCapture {
    /// For runs that are trained, and not only tried out.
    ///
    /// * `run`: folder for what is made of the capture, as that of a run.
    pub(super) fn for_training(run: PathBuf) -> Self {
        Self { loaded: None, run: Some(run) }
    }

    /// The capture of a run; decides what its configuration left to it.
    ///
    /// As `train` alone would load it: where a capture has no points, those drawn at random follow the run's seed, and nothing else does.
    pub(super) fn of(&mut self, config: &mut RunConfig) -> Result<&Capture> {
        let is_here = |(loaded, capture): &(RunConfig, Capture)| {
            let is_any_seed = capture.points_origin != PointsOrigin::Random;
            (&loaded.dataset, &loaded.capture) == (&config.dataset, &config.capture)
                && (is_any_seed || loaded.train.seed == config.train.seed)
        };
        // Another one goes before the next is loaded: never two in memory.
        let kept = self.loaded.take().filter(is_here);
        process::forget_peak_memory();
        let capture = match kept {
            Some((_, capture)) => {
                train::decide(config, &capture)?;
                capture
            }
            None => train::load(config, self.run.as_deref(), None)?,
        };
        Ok(&self.loaded.insert((config.clone(), capture)).1)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use pocketsplat_capture::synth::{SynthOptions, write_capture};

    use super::*;

    /// Where the points come from, and whether a run of another seed does without the files that the first one read.
    fn second_seed(dataset: &Path) -> (PointsOrigin, bool) {
        let mut loaded = LoadedCapture::default();
        let mut of = |seed| {
            let mut config = RunConfig { dataset: dataset.to_owned(), ..RunConfig::default() };
            config.capture.n_random_points = Some(50);
            config.train.seed = seed;
            loaded.of(&mut config).map(|capture| capture.points_origin)
        };
        let origin = of(1).unwrap();
        let away = dataset.with_extension("away");
        fs::rename(dataset, &away).unwrap();
        assert_eq!(of(1).unwrap(), origin, "the same seed");
        let is_shared = of(2).is_ok();
        fs::rename(away, dataset).unwrap();
        (origin, is_shared)
    }

    #[test]
    fn runs_of_other_seeds_share_a_capture_that_has_points() {
        let home = tempfile::tempdir().unwrap();
        let capture = home.path().join("capture");
        let options =
            SynthOptions { size_px: 32, n_train: 6, n_test: 2, samples_per_axis: 1, ..SynthOptions::default() };
        write_capture(&capture, &options).unwrap();
        assert_eq!(second_seed(&capture), (PointsOrigin::Random, false));

        // The same with points of its own.
        let transforms = fs::read_to_string(capture.join("transforms_train.json")).unwrap();
        let with_points = transforms.replacen('{', "{ \"ply_file_path\": \"points.ply\",", 1);
        fs::write(capture.join("transforms.json"), with_points).unwrap();
        for split in ["train", "test"] {
            fs::remove_file(capture.join(format!("transforms_{split}.json"))).unwrap();
        }
        let header = "ply\nformat ascii 1.0\nelement vertex 60\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
        let points: String = (0..60).map(|i| format!("0.{i} 0.1 0.{}\n", (7 * i) % 60)).collect();
        fs::write(capture.join("points.ply"), format!("{header}{points}")).unwrap();
        assert_eq!(second_seed(&capture), (PointsOrigin::Capture, true));
    }
}

//! What a finished run says to people; `result.json` and `--json` say all of it.

use std::fmt;
use std::path::Path;

use super::super::estimate::duration;
use super::result::{HeldOut, PoseChange, TrainResult};

/// What they want to know.
pub(super) struct Summary<'a> {
    pub(super) held_out: Option<&'a HeldOut>,
    pub(super) path: &'a Path,
    pub(super) n_bytes: usize,
    /// Of a bundle: its level, 0 for none, and its profile.
    pub(super) level: Option<(u8, &'a str)>,
    pub(super) peak_memory_bytes: Option<u64>,
    pub(super) train_s: f64,
    /// Processor time of all threads.
    pub(super) train_processor_s: f64,
    /// Of the steps' time; `None` where photographs lie in memory.
    pub(super) photographs_waited_share: Option<f64>,
    pub(super) iterations: u32,
    pub(super) dropped_steps: u32,
    /// Of all training cameras, where poses were refined.
    pub(super) poses: Option<&'a [PoseChange]>,
}

impl<'a> Summary<'a> {
    /// * `bundle`: its path as people know it.
    pub(super) fn of(result: &'a TrainResult, bundle: &'a Path) -> Self {
        Self {
            held_out: result.held_out.as_ref(),
            path: bundle,
            n_bytes: result.bundle_bytes,
            level: Some((result.level, &result.profile)),
            peak_memory_bytes: result.peak_memory_bytes,
            train_s: result.train_s,
            train_processor_s: result.train_processor_s,
            photographs_waited_share: result.photographs_waited_share,
            iterations: result.iterations,
            dropped_steps: result.dropped_steps,
            poses: result.poses.as_deref(),
        }
    }
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.held_out {
            Some(HeldOut { psnr_db, ssim, n_test_views, .. }) => writeln!(
                f,
                "quality:  {psnr_db:.2} dB PSNR, {ssim:.4} SSIM, means of {n_test_views} views that were held out"
            )?,
            None => writeln!(f, "quality:  not measured, for no view is held out; --test-every 8 holds some out")?,
        }
        writeln!(f, "size:     {} bytes, {}", self.n_bytes, self.path.display())?;
        match self.level {
            None => {}
            Some((0, profile)) => writeln!(f, "level:    none, profile {profile}")?,
            Some((level, profile)) => writeln!(f, "level:    {level}, profile {profile}")?,
        }
        if let Some(bytes) = self.peak_memory_bytes {
            writeln!(f, "memory:   {:.2} GB at most", bytes as f64 / 1e9)?;
        }
        let (time, core) = (duration(self.train_s / 60.0), duration(self.train_processor_s / 60.0));
        writeln!(f, "time:     {time} for {} iterations, {core} of one processor core", self.iterations)?;
        if let Some(share) = self.photographs_waited_share {
            writeln!(f, "waiting:  {:.1} % of that for photographs, which do not lie in memory", 100.0 * share)?;
        }
        if let Some(poses) = self.poses {
            let root_mean_square = |of: fn(&PoseChange) -> f64| {
                (poses.iter().map(|p| of(p).powi(2)).sum::<f64>() / poses.len() as f64).sqrt()
            };
            let turned = root_mean_square(|pose| pose.turned_degrees);
            writeln!(f, "poses:    cameras were turned by {turned:.2} degrees (root mean square), see result.json")?;
        }
        if self.dropped_steps > 0 {
            writeln!(f, "dropped:  {} of the iterations, see progress.csv in the run folder", self.dropped_steps)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_want_to_know_comes_in_words_and_units() {
        let held_out =
            HeldOut { psnr_db: 32.041, cc_psnr_db: Some(33.2), ssim: 0.951_23, n_test_views: 13, views: Vec::new() };
        let summary = Summary {
            held_out: Some(&held_out),
            path: Path::new("desk lamp.psb"),
            n_bytes: 412_345,
            level: Some((5, "Full")),
            peak_memory_bytes: Some(612_000_000),
            train_s: 744.0,
            train_processor_s: 1320.0,
            photographs_waited_share: None,
            iterations: 7000,
            dropped_steps: 0,
            poses: None,
        };
        assert_eq!(
            summary.to_string(),
            "quality:  32.04 dB PSNR, 0.9512 SSIM, means of 13 views that were held out\n\
             size:     412345 bytes, desk lamp.psb\n\
             level:    5, profile Full\n\
             memory:   0.61 GB at most\n\
             time:     12 minutes for 7000 iterations, 22 minutes of one processor core\n"
        );
        let unmeasured = Summary { held_out: None, peak_memory_bytes: None, dropped_steps: 3, ..summary }.to_string();
        let pose = |turned_degrees| PoseChange { view: String::new(), turned_degrees, moved: 0.0 };
        let refined = Summary { poses: Some(&[pose(0.3), pose(0.4)]), ..summary }.to_string();
        assert!(refined.contains("poses:    cameras were turned by 0.35 degrees"), "{refined}");
        let cached = Summary { photographs_waited_share: Some(0.0123), ..summary };
        assert!(cached.to_string().contains("waiting:  1.2 % of that for photographs"), "{cached}");
        assert!(unmeasured.contains("no view is held out") && unmeasured.contains("dropped:  3 of"), "{unmeasured}");
    }
}

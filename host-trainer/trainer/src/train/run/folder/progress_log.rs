//! How a run went, as a table for plots.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{RunError, files};
use crate::train::run::{Method, Run};
use pocketsplat_kernels::step::coding::RateReport;

const HEADER: &str =
    "iteration,loss,psnr_db,anchors,seconds,dropped,feature_bits,log_scale_bits,offset_bits,drawn_offsets";

/// Rows of a whole run, about.
const ROWS: u32 = 500;

/// What the log keeps of an iteration.
#[derive(Clone, Copy, Debug)]
pub struct LoggedStep {
    /// The loss.
    pub loss: f64,
    /// Mean squared difference of image and photograph.
    pub squared_error: f64,
    /// What coding cost, where there is a rate.
    pub rate: Option<RateReport>,
    /// Whether it changed nothing.
    pub is_dropped: bool,
}

/// A CSV file with one row every five hundredth of a run: iterations done, means of loss and PSNR (dB) since the row
/// before, anchors, seconds spent in iterations, steps dropped so far; mean bits of an anchor's features, log-scales and
/// offsets since the row before, where there is a rate, and offsets that are drawn, of all anchors. Explicit Gaussians count as anchors
/// with one offset each.
#[derive(Debug)]
pub struct ProgressLog {
    path: PathBuf,
    file: File,
    every: u32,
    loss: f64,
    psnr_db: f64,
    n: u32,
    bits: [f64; 3],
    n_sampled: usize,
    /// Of a photograph in which a single value is off by one level.
    least_squared_error: f64,
}

impl ProgressLog {
    /// Opens the log of a run, and drops rows of iterations that it has not done: they were written after the checkpoint from
    /// which the run goes on, and will be written again.
    ///
    /// # Errors
    /// [`RunError`] when it cannot be read or written.
    pub fn open(path: &Path, run: &Run<'_, impl Method>) -> Result<Self, RunError> {
        let done = run.iteration();
        let older = match fs::read(path) {
            // A power cut may leave anything.
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(source) => return Err(RunError::io("read", path, source)),
        };
        let valid = |row: &&str| row.split(',').next().and_then(|n| n.parse().ok()).is_some_and(|n: u32| n <= done);
        files::write_whole(path, |out| {
            writeln!(out, "{HEADER}")?;
            // A last row without its end was cut off.
            older
                .split_inclusive('\n')
                .filter(|row| row.ends_with('\n'))
                .filter(valid)
                .try_for_each(|row| write!(out, "{row}"))
        })?;
        let file = File::options().append(true).open(path).map_err(|source| RunError::io("open", path, source))?;
        let every = (run.iterations() / ROWS).max(1);
        let n_pixels: f64 = run.capture().largest_px().map(f64::from).iter().product();
        Ok(Self {
            path: path.to_owned(),
            file,
            every,
            loss: 0.0,
            psnr_db: 0.0,
            n: 0,
            bits: [0.0; 3],
            n_sampled: 0,
            least_squared_error: 1.0 / (255.0 * 255.0 * 3.0 * n_pixels.max(1.0)),
        })
    }

    /// Whether the run's last iteration ends a row.
    pub fn is_due(&self, run: &Run<'_, impl Method>) -> bool {
        run.iteration().is_multiple_of(self.every) || run.is_done()
    }

    /// Adds an iteration.
    ///
    /// # Errors
    /// [`RunError::Write`] when a row was due and could not be written.
    pub fn add<M: Method>(&mut self, run: &Run<'_, M>, step: &LoggedStep) -> Result<(), RunError> {
        if !step.is_dropped {
            self.loss += step.loss;
            // A view that is reproduced exactly has an infinite PSNR, and so would every mean with it, which no curve shows. As
            // `psnr_db_masked` has it, such a view counts as one in which a single value is off by one level.
            self.psnr_db -= 10.0 * step.squared_error.max(self.least_squared_error).log10();
            self.n += 1;
            if let Some(rate) = step.rate {
                let n = rate.n_sampled as f64;
                self.bits = std::array::from_fn(|i| self.bits[i] + n * rate.bits[i]);
                self.n_sampled += rate.n_sampled;
            }
        }
        let iteration = run.iteration();
        if !self.is_due(run) {
            return Ok(());
        }
        let means = match self.n {
            // Nothing but dropped steps: no number, rather than NaN.
            0 => ",".to_owned(),
            n => format!("{:.6},{:.3}", self.loss / f64::from(n), self.psnr_db / f64::from(n)),
        };
        let bits = match self.n_sampled {
            0 => ",,".to_owned(),
            n => self.bits.map(|bits| format!("{:.2}", bits / n as f64)).join(","),
        };
        let [n_anchors, n_drawn] = M::size(&run.state.learned);
        let (seconds, n_dropped) = (run.seconds(), run.n_dropped());
        let row = format!("{iteration},{means},{n_anchors},{seconds:.3},{n_dropped},{bits},{n_drawn}\n");
        (self.loss, self.psnr_db, self.n) = (0.0, 0.0, 0);
        (self.bits, self.n_sampled) = ([0.0; 3], 0);
        // In one piece, so that rows are not cut by a crash of the process.
        self.file.write_all(row.as_bytes()).map_err(|source| RunError::Write { path: self.path.clone(), source })
    }
}

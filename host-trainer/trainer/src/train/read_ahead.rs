//! Photographs that do not lie in memory, read by a thread before their steps come.

use std::collections::VecDeque;
use std::iter;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use pocketsplat_capture::dataset::{Photograph, PhotographError, View};

/// Bytes of photographs that are read ahead at most; one is, however large.
const WINDOW_BYTES: usize = 64 << 20;

type Answer = Result<Arc<Photograph>, PhotographError>;

/// A photograph that was asked for, and where it will come.
type Asked = (u32, Receiver<Answer>);

/// Hands out photographs, and has those of the next steps read meanwhile.
#[derive(Debug, Default)]
pub(crate) struct ReadAhead {
    reader: Option<Sender<(View, Sender<Answer>)>>,
    asked: VecDeque<Asked>,
    /// Shared with those [beside](Self::beside).
    waited_ns: Arc<AtomicU64>,
    worked: Duration,
    was_used: bool,
}

impl Clone for ReadAhead {
    /// Another one, which has read nothing.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl ReadAhead {
    /// The photograph of the first view of `order`; those that follow it are read until they are asked for.
    ///
    /// * `order`: places in `views`, in the order in which their photographs will be asked for, as far as it is known; not empty.
    ///
    /// # Errors
    /// That of [`View::photograph`].
    pub(crate) fn photograph(&mut self, views: &[View], order: impl IntoIterator<Item = u32>) -> Answer {
        let mut order = order.into_iter();
        let first = order.next().expect("a view that is asked for");
        let view = &views[first as usize];
        if view.is_in_memory() {
            return view.photograph();
        }
        self.was_used = true;
        let started = Instant::now();
        let n_ahead = (WINDOW_BYTES / view.decoded_bytes().max(1)).max(1);
        let coming: Vec<u32> = iter::once(first).chain(order.take(n_ahead)).collect();
        // After another order than was known, what was asked for is of no use.
        let n_known = self.asked.iter().zip(&coming).take_while(|((asked, _), wanted)| asked == *wanted).count();
        self.asked.truncate(n_known);
        for index in &coming[n_known..] {
            self.ask(*index, &views[*index as usize]);
        }
        let answer = self.asked.pop_front().map(|(_, answer)| answer.recv());
        // A thread that could not be started, or ended in a panic, is no reason to end a run.
        let photograph = answer.and_then(Result::ok).unwrap_or_else(|| view.photograph());
        let waited_ns = u64::try_from(started.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.waited_ns.fetch_add(waited_ns, Ordering::Relaxed);
        photograph
    }

    fn ask(&mut self, index: u32, view: &View) {
        let (to, from) = channel();
        let reader = self.reader.get_or_insert_with(reader);
        // Nobody hears it where there is no thread, and then nothing comes.
        let _ = reader.send((view.clone(), to));
        self.asked.push_back((index, from));
    }

    /// Another one for a pass over the views within a step, whose waits count as this one's.
    pub(crate) fn beside(&self) -> Self {
        Self { waited_ns: self.waited_ns.clone(), ..Self::default() }
    }

    fn waited(&self) -> Duration {
        Duration::from_nanos(self.waited_ns.load(Ordering::Relaxed))
    }

    /// Notes that a step took so long, the wait for its photograph included.
    pub(crate) fn worked(&mut self, step: Duration) {
        self.worked += step;
    }

    /// The share of the steps' time that was spent on waiting for photographs; `None` where they lie in memory.
    pub(crate) fn waited_share(&self) -> Option<f64> {
        self.was_used.then(|| self.waited().as_secs_f64() / self.worked.as_secs_f64().max(f64::MIN_POSITIVE))
    }
}

/// Starts a thread that reads what it is asked for, in that order, until nobody asks any more.
///
/// Not one of rayon's: those compute the step.
fn reader() -> Sender<(View, Sender<Answer>)> {
    let (to, requests) = channel::<(View, Sender<Answer>)>();
    let read = move || {
        for (view, to) in requests {
            // Whoever asked may have gone.
            let _ = to.send(view.photograph());
        }
    };
    // Without it the receiver goes, and every photograph is read when it is needed.
    let _ = thread::Builder::new().name("photographs".to_owned()).spawn(read);
    to
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::explicit::config::CloudConfig;
    use crate::explicit::train::CloudTrainer;
    use crate::train::Trainer;
    use crate::train::test_capture::tiny_hac_config;
    use pocketsplat_capture::dataset::{Capture, LoadOptions, load};
    use pocketsplat_capture::synth::{SynthOptions, write_capture};

    /// Five views; their photographs in memory, in a cache, and in the capture.
    fn captures(folder: &Path) -> [Capture; 3] {
        let options =
            SynthOptions { size_px: 24, n_train: 5, n_test: 1, samples_per_axis: 1, ..SynthOptions::default() };
        write_capture(&folder.join("capture"), &options).expect("a capture");
        let cache = Some(folder.join("cache"));
        let in_memory = LoadOptions { n_random_points: 300, ..LoadOptions::default() };
        let in_capture = LoadOptions { in_memory_bytes: 0, ..in_memory.clone() };
        let in_cache = LoadOptions { cache, ..in_capture.clone() };
        [in_memory, in_cache, in_capture].map(|options| load(&folder.join("capture"), &options).expect("it loads").0)
    }

    #[test]
    fn photographs_come_in_any_order_that_is_asked_for() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let [in_memory, in_cache, _] = captures(folder.path());
        let (mut ahead, mut none) = (ReadAhead::default(), ReadAhead::default());
        // The second is not the one that was to follow; the last three ask for what is read already.
        for order in [&[0, 1, 2, 3][..], &[3, 1, 4], &[1, 4, 0], &[4], &[0, 2], &[2], &[2]] {
            let expected = in_memory.train[order[0] as usize].photograph().expect("in memory");
            let found = ahead.photograph(&in_cache.train, order.iter().copied()).expect("in the cache");
            assert_eq!(found, expected, "{order:?}");
            assert_eq!(none.photograph(&in_memory.train, order.iter().copied()).expect("in memory"), expected);
        }
        let mut beside = ahead.beside();
        beside.photograph(&in_cache.train, [3]).expect("in the cache");
        assert_eq!(beside.waited(), ahead.waited());
        ahead.worked(ahead.waited() * 4);
        assert_eq!((none.waited_share(), ahead.clone().waited_share()), (None, None));
        assert!(ahead.waited_share().is_some_and(|share| (share - 0.25).abs() < 1e-6));
        std::fs::remove_dir_all(folder.path().join("cache")).expect("a cache");
        // What was read before is there; then the error of the view that is asked for.
        let mut ahead = ReadAhead::default();
        let error = ahead.photograph(&in_cache.train, [2, 3]).expect_err("gone").to_string();
        assert!(error.contains(&in_cache.train[2].name), "{error}");
    }

    #[test]
    fn a_run_has_the_same_bits_wherever_its_photographs_lie() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let runs = captures(folder.path()).map(|capture| {
            let mut trainer = Trainer::new(&capture, tiny_hac_config(60)).expect("a run");
            let mut explicit =
                CloudTrainer::new(&capture, CloudConfig { iterations: 20, ..CloudConfig::default() }).expect("a run");
            while !trainer.is_done() {
                trainer.advance().expect("an iteration");
            }
            while !explicit.is_done() {
                explicit.advance().expect("an iteration");
            }
            let worth = trainer.view().worth().expect("a context model");
            assert_eq!(trainer.waited_share().is_some(), !capture.train[0].is_in_memory());
            assert_eq!(explicit.waited_share().is_some(), !capture.train[0].is_in_memory());
            let (mut checkpoint, mut explicit_checkpoint) = (Vec::new(), Vec::new());
            let clocks = [&mut trainer.state.seconds, &mut trainer.state.processor_seconds];
            clocks
                .into_iter()
                .chain([&mut explicit.state.seconds, &mut explicit.state.processor_seconds])
                .for_each(|s| *s = 0.0);
            trainer.save(&mut checkpoint).expect("memory");
            explicit.save(&mut explicit_checkpoint).expect("memory");
            (checkpoint, explicit_checkpoint, worth)
        });
        assert!(runs[1..].iter().all(|run| *run == runs[0]), "checkpoints and worth to the bit");
    }
}

//! Ctrl-C, SIGTERM and SIGHUP, which a run answers after its iteration.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use anyhow::{Context, Result};
use signal_hook::consts::{SIGINT, SIGTERM};

/// Exit code of a process that a signal ended with a checkpoint.
pub(crate) const INTERRUPTED: u8 = 130;

/// A flag that Ctrl-C, SIGTERM or the loss of the terminal sets; a second Ctrl-C or SIGTERM ends the process at once.
///
/// What is ignored stays so: SIGHUP under `nohup`, Ctrl-C in the background of a script.
pub(crate) fn flag() -> Result<Arc<AtomicBool>> {
    // One of the process: what was asked for in one part of a command holds for the next.
    static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    if let Some(stop) = FLAG.get() {
        return Ok(Arc::clone(stop));
    }
    let stop = listening()?;
    Ok(Arc::clone(FLAG.get_or_init(|| stop)))
}

fn listening() -> Result<Arc<AtomicBool>> {
    let (stop, asked) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    for signal in [SIGINT, SIGTERM] {
        if is_ignored(signal) {
            continue;
        }
        // In this order: the first signal finds its flag unset, and then sets it.
        signal_hook::flag::register_conditional_shutdown(signal, i32::from(INTERRUPTED), Arc::clone(&asked))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&asked)))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&stop)))
            .context("could not listen to Ctrl-C")?;
    }
    // A terminal that closes and its shell send it both, and a service manager with SIGTERM: it never ends the process at once.
    #[cfg(unix)]
    if !is_ignored(signal_hook::consts::SIGHUP) {
        let heard = signal_hook::flag::register(signal_hook::consts::SIGHUP, Arc::clone(&stop));
        heard.context("could not listen to SIGHUP")?;
    }
    Ok(stop)
}

/// Whether this process was started with a signal ignored.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let mut found = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    #[expect(unsafe_code, reason = "the standard library does not tell how signals are answered")]
    // SAFETY: without a new action `sigaction` changes nothing and fills `found`, of whose bytes every value is sound.
    let found = unsafe {
        let failed = libc::sigaction(signal, std::ptr::null(), found.as_mut_ptr());
        (failed == 0).then(|| found.assume_init())
    };
    found.is_some_and(|found| found.sa_sigaction == libc::SIG_IGN)
}

#[cfg(not(unix))]
fn is_ignored(_: i32) -> bool {
    false
}

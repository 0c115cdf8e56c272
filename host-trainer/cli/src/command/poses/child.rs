//! A program at work: what it says goes to the log and to whoever listens, and it ends when we do.

use std::io::{BufRead as _, BufReader, PipeReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use anyhow::{Context, Result};
use pocketsplat_files::shell_word;

use super::log::Log;

/// How long a signal may wait for its answer.
const PATIENCE: Duration = Duration::from_millis(100);

/// How a program ended.
#[derive(Debug)]
pub(super) enum Ended {
    Well,
    /// With an exit code that is none of success.
    Badly(ExitStatus),
    /// We were asked to stop, and ended it.
    Stopped,
}

/// What a program works for: its log, and the flag that asks us to stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Work<'a> {
    pub(super) log: &'a Log,
    pub(super) stop: &'a AtomicBool,
}

impl Work<'_> {
    pub(super) fn is_stopped(self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Runs a program to its end.
    ///
    /// * `heard`: gets each line that it says, on stdout or stderr.
    pub(super) fn run(self, mut command: Command, mut heard: impl FnMut(&str)) -> Result<Ended> {
        let (reader, writer) = std::io::pipe().context("could not make a pipe")?;
        command.stdout(writer.try_clone()?).stderr(writer);
        let mut child = self.start(&mut command)?;
        // With it go our writing ends of the pipe, so that it ends where the program does.
        drop(command);
        let lines = listen(reader, self.log.clone());
        loop {
            match lines.recv_timeout(PATIENCE) {
                Ok(line) => heard(&line),
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
            if self.is_stopped() {
                end(&mut child);
                return Ok(Ended::Stopped);
            }
        }
        self.ended(&mut child)
    }

    /// Runs a program whose stdout is data; what it says on stderr goes to the log.
    ///
    /// * `n_bytes`: of each piece that `read` gets.
    pub(super) fn read(
        self,
        mut command: Command,
        n_bytes: usize,
        mut read: impl FnMut(&[u8]) -> Result<()>,
    ) -> Result<Ended> {
        let (reader, writer) = std::io::pipe().context("could not make a pipe")?;
        command.stdout(Stdio::piped()).stderr(writer);
        let mut child = self.start(&mut command)?;
        drop(command);
        let lines = listen(reader, self.log.clone());
        let mut data = child.stdout.take().context("there is no stdout")?;
        let mut piece = vec![0; n_bytes];
        while is_filled(&mut data, &mut piece)? {
            if let Err(error) = read(&piece) {
                end(&mut child);
                return Err(error);
            }
            if self.is_stopped() {
                end(&mut child);
                return Ok(Ended::Stopped);
            }
        }
        drop(data);
        lines.iter().for_each(drop);
        self.ended(&mut child)
    }

    fn start(self, command: &mut Command) -> Result<Child> {
        self.log.line(&format!("$ {}", words_of(command)));
        ends_with_us(command);
        command.spawn().with_context(|| format!("could not start `{}`", Path::new(command.get_program()).display()))
    }

    fn ended(self, child: &mut Child) -> Result<Ended> {
        let status = child.wait().context("a program is gone")?;
        // Ctrl-C on a terminal reaches the program as well, and it may be faster.
        std::thread::sleep(if status.success() { Duration::ZERO } else { PATIENCE });
        Ok(match status.success() {
            true => Ended::Well,
            false if self.is_stopped() => Ended::Stopped,
            false => Ended::Badly(status),
        })
    }
}

/// Fills the piece from a stream; `false` where that has ended.
fn is_filled(data: &mut impl Read, piece: &mut [u8]) -> Result<bool> {
    match data.read_exact(piece) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error).context("could not read what a program gives"),
    }
}

/// Ends a program that is not needed any more.
fn end(child: &mut Child) {
    // It may have ended by itself.
    let _ = child.kill();
    let _ = child.wait();
}

/// The lines of a pipe, which all go to the log.
fn listen(reader: PipeReader, log: Log) -> Receiver<String> {
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        let mut reader = BufReader::new(reader);
        let mut bytes = Vec::new();
        while reader.read_until(b'\n', &mut bytes).is_ok_and(|n| n > 0) {
            let line = String::from_utf8_lossy(&bytes).trim_end().to_owned();
            bytes.clear();
            log.line(&line);
            // Nobody has to listen.
            let _ = sender.send(line);
        }
    });
    lines
}

/// A command as a person would give it.
fn words_of(command: &Command) -> String {
    let words = [command.get_program()].into_iter().chain(command.get_args());
    words.map(|word| shell_word(Path::new(word))).map(own_option).collect::<Vec<_>>().join(" ")
}

/// Options are no paths, which never begin like one.
fn own_option(word: String) -> String {
    word.strip_prefix("./-").map_or(word.clone(), |rest| format!("-{rest}"))
}

/// Lets the system end the program when this process ends, however: what is left of `kill -9` must not go on writing.
#[cfg(target_os = "linux")]
fn ends_with_us(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;
    let ask = || match unsafe_prctl() {
        -1 => Err(std::io::Error::last_os_error()),
        _ => Ok(()),
    };
    #[expect(unsafe_code, reason = "the standard library does not tie a program's life to ours")]
    // SAFETY: between fork and exec `ask` makes one system call and allocates nothing.
    unsafe {
        command.pre_exec(ask);
    }
}

#[cfg(target_os = "linux")]
fn unsafe_prctl() -> libc::c_int {
    #[expect(unsafe_code, reason = "the standard library does not tie a program's life to ours")]
    // SAFETY: this call of `prctl` takes a number and touches no memory.
    unsafe {
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL)
    }
}

#[cfg(not(target_os = "linux"))]
fn ends_with_us(_: &mut Command) {}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn what_a_program_says_is_heard_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let log = Log::open(&folder.path().join("poses.log")).unwrap();
        let stop = AtomicBool::new(false);
        let work = Work { log: &log, stop: &stop };
        let mut heard = Vec::new();
        let ended = work.run(shell("echo one; echo two >&2; exit 3"), |line| heard.push(line.to_owned())).unwrap();
        assert!(matches!(ended, Ended::Badly(status) if status.code() == Some(3)));
        heard.sort();
        assert_eq!(heard, ["one", "two"]);
        let mut data = Vec::new();
        let ended = work.read(shell("printf abcdef; echo said >&2"), 2, |piece| {
            data.push(piece.to_vec());
            Ok(())
        });
        assert!(matches!(ended.unwrap(), Ended::Well));
        assert_eq!(data, [b"ab", b"cd", b"ef"]);
        let kept = std::fs::read_to_string(log.path()).unwrap();
        assert!(kept.starts_with("$ sh -c 'echo one; echo two >&2; exit 3'\n"), "{kept}");
        assert!(kept.contains("\ntwo\n") && kept.contains("\nsaid\n"), "{kept}");
    }

    #[test]
    fn a_program_ends_when_we_are_asked_to_stop() {
        let folder = tempfile::tempdir().unwrap();
        let log = Log::open(&folder.path().join("poses.log")).unwrap();
        let stop = AtomicBool::new(false);
        let work = Work { log: &log, stop: &stop };
        let started = std::time::Instant::now();
        let ended = work.run(shell("echo begun; exec sleep 60"), |_| stop.store(true, Ordering::Relaxed)).unwrap();
        assert!(matches!(ended, Ended::Stopped));
        assert!(started.elapsed() < Duration::from_secs(30));
    }
}

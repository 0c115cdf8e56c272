//! Instructions of a frame, stage by stage.

use pocketsplat_core::{Stage, Stopwatch};
use semihosting::{fs, io, io::Write as _};

use crate::board;

/// Adds up the instructions of each stage.
pub(crate) struct Instructions {
    /// As [`Stage::ALL`] orders them.
    pub(crate) spent: [u64; Stage::ALL.len()],
    stage: Stage,
    since: u64,
}

impl Instructions {
    /// From now on.
    pub(crate) fn start() -> Self {
        Self { spent: [0; Stage::ALL.len()], stage: Stage::Project, since: board::instructions() }
    }
}

impl Stopwatch for Instructions {
    fn enter(&mut self, stage: Stage) {
        let now = board::instructions();
        if let Some(spent) = self.spent.get_mut(self.stage as usize) {
            *spent += now - self.since;
        }
        (self.stage, self.since) = (stage, now);
    }
}

/// The table of all frames, a file in the folder in which QEMU runs.
pub(crate) struct Table(fs::File);

impl Table {
    /// With the row of what was spent before the first frame.
    pub(crate) fn create(bind: u64) -> io::Result<Self> {
        let mut file = fs::File::create(c"instructions.csv")?;
        write!(file, "frame,stage,instructions\n-,bind,{bind}\n")?;
        Ok(Self(file))
    }

    /// Adds the rows of a frame.
    pub(crate) fn add(&mut self, frame: u8, instructions: &Instructions) -> io::Result<()> {
        for (stage, spent) in Stage::ALL.into_iter().zip(instructions.spent) {
            writeln!(self.0, "{frame},{},{spent}", stage.name())?;
        }
        Ok(())
    }
}

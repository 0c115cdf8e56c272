//! How a call ended.

use core::ffi::{CStr, c_char};
use core::fmt::{self, Write as _};

use pocketsplat_core::{DecodeError, ErrorClass, RenderError};

/// How a call ended, and whose fault it is if not well.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// The bytes are not a sound bundle: fetch or flash them again.
    Malformed = 1,
    /// A sound bundle that needs a newer or a fuller decoder.
    Unsupported = 2,
    /// The memory given is not enough; the message names the bytes that would do.
    OverBudget = 3,
    /// An argument is NULL where it must not be, or outside its limits.
    Misuse = 4,
    /// The caller's function stopped the frame.
    Stopped = 5,
    /// A mistake in pocketsplat; please report it.
    Internal = 6,
}

/// Characters of a message, the final NUL included.
const MESSAGE_LEN: usize = 192;

/// What was wrong, for people: the place, the number found and the number needed. Longer texts are cut.
#[repr(C)]
#[derive(Debug)]
pub struct Message {
    /// Ends with NUL.
    pub text: [c_char; 192],
}

/// The name of a status, such as "over budget"; "unknown" for other numbers. Static, ends with NUL.
#[unsafe(no_mangle)]
pub extern "C" fn psb_status_name(status: u32) -> *const c_char {
    const NAMES: [&CStr; 7] =
        [c"ok", c"malformed", c"unsupported", c"over budget", c"misuse", c"stopped", c"internal error"];
    NAMES.get(status as usize).copied().unwrap_or(c"unknown").as_ptr()
}

/// Why a call ended early.
pub(crate) enum Failure {
    /// The decoder refused.
    Decode(DecodeError),
    /// The C side gave what no call takes.
    Misuse(&'static str),
    /// A number that no call takes; what it is and what it may be.
    Number(&'static str, usize),
    /// The caller's function returned this number.
    Stopped(i32),
}

impl From<RenderError<i32>> for Failure {
    fn from(error: RenderError<i32>) -> Self {
        match error {
            RenderError::Decode(error) => Self::Decode(error),
            RenderError::Sink(code) => Self::Stopped(code),
        }
    }
}

impl From<DecodeError> for Failure {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}

impl Failure {
    fn status(&self) -> Status {
        match self {
            Self::Misuse(_) | Self::Number(..) => Status::Misuse,
            Self::Stopped(_) => Status::Stopped,
            Self::Decode(error) => match error.class() {
                ErrorClass::Malformed => Status::Malformed,
                ErrorClass::Unsupported => Status::Unsupported,
                ErrorClass::OverBudget => Status::OverBudget,
                ErrorClass::Misuse => Status::Misuse,
                ErrorClass::Internal => Status::Internal,
            },
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Decode(error) => error.fmt(f),
            Self::Misuse(what) => f.write_str(what),
            Self::Number(needed, found) => write!(f, "{needed}; found {found}"),
            Self::Stopped(code) => write!(f, "the frame is not complete: the function for tiles returned {code}"),
        }
    }
}

/// Writes as much of a text as there is room for.
struct Cut<'a> {
    text: &'a mut [c_char; MESSAGE_LEN],
    len: usize,
}

impl fmt::Write for Cut<'_> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        let room = &mut self.text[self.len..MESSAGE_LEN - 1];
        for (place, byte) in room.iter_mut().zip(part.bytes()) {
            *place = byte as c_char;
            self.len += 1;
        }
        Ok(())
    }
}

/// The status of an outcome; says in `message` what was wrong, or nothing.
pub(crate) fn status_of(outcome: Result<(), Failure>, message: Option<&mut Message>) -> Status {
    let said = message.map(|message| {
        message.text = [0; MESSAGE_LEN];
        Cut { text: &mut message.text, len: 0 }
    });
    match outcome {
        Ok(()) => Status::Ok,
        Err(failure) => {
            if let Some(mut cut) = said {
                // A text that is cut is no failure.
                let _ = write!(cut, "{failure}");
            }
            failure.status()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_too_long_is_cut_and_ends() {
        let mut message = Message { text: [1; MESSAGE_LEN] };
        let long = "x".repeat(500);
        let status = status_of(Err(Failure::Misuse(long.leak())), Some(&mut message));
        assert_eq!(
            (status, message.text[MESSAGE_LEN - 2], message.text[MESSAGE_LEN - 1]),
            (Status::Misuse, b'x' as c_char, 0)
        );
        assert_eq!((status_of(Ok(()), Some(&mut message)), message.text[0]), (Status::Ok, 0));
    }
}

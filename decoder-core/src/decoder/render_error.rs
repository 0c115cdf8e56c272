//! What ends a frame early.

use core::convert::Infallible;
use core::fmt;

use pocketsplat_format::DecodeError;

/// Why a frame was not drawn to its end: the decoder's error, or the first one of the sink that takes its tiles.
///
/// Where the sink takes every tile (its error is [`Infallible`]), `?` turns it into a [`DecodeError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RenderError<E> {
    /// The decoder refused the camera or the bundle.
    Decode(DecodeError),
    /// The sink refused a tile; it got none after it.
    Sink(E),
}

impl<E> From<DecodeError> for RenderError<E> {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}

impl From<RenderError<Infallible>> for DecodeError {
    fn from(error: RenderError<Infallible>) -> Self {
        match error {
            RenderError::Decode(error) => error,
            RenderError::Sink(never) => match never {},
        }
    }
}

// `Debug`, because the errors of most displays are nothing else.
impl<E: fmt::Debug> fmt::Display for RenderError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Decode(error) => error.fmt(f),
            Self::Sink(error) => write!(f, "the frame is not complete, its sink failed: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for RenderError<E> {}

//! What a method does, whichever it is.

use pocketsplat_capture::dataset::Capture;
use pocketsplat_gaussians::Gaussians;
use pocketsplat_trainer::explicit::CloudConfig;
use pocketsplat_trainer::train::TrainError;

/// What a method starts from: 3D Gaussian Splatting that was trained, and what it was trained on.
///
/// A method that trains by itself takes the capture and the settings, and leaves the Gaussians.
#[derive(Clone, Copy, Debug)]
pub struct TrainedScene<'a> {
    /// As training left them, normalised frame.
    pub gaussians: &'a Gaussians,
    /// The photographs.
    pub capture: &'a Capture,
    /// How they were trained: a method goes on with these rates.
    pub config: &'a CloudConfig,
}

/// A published method that makes a small file of a scene of explicit Gaussians.
///
/// What is scored is `decode(&encode(&compressed))`, and a size is the length of these bytes.
pub trait Baseline {
    /// As tables name it.
    const NAME: &'static str;

    /// What the method has before it writes: everything that decides its bytes.
    type Compressed;

    /// All of the method but the writing: the same for any number of threads.
    ///
    /// # Errors
    /// [`TrainError::NoViews`], [`TrainError::Photograph`], and [`TrainError::Diverged`].
    fn compress(&self, scene: &TrainedScene<'_>) -> Result<Self::Compressed, TrainError>;

    /// The file.
    fn encode(compressed: &Self::Compressed) -> Vec<u8>;

    /// The Gaussians of a file, normalised frame of the capture; a method whose colours a network gives writes them as harmonics here.
    ///
    /// # Errors
    /// [`Unreadable`] for bytes that [`Self::encode`] did not write. Memory follows what the bytes inflate to, 1 GiB at most, never a count in them.
    fn decode(bytes: &[u8]) -> Result<Gaussians, Unreadable>;
}

/// Why bytes are no file of a method: what was found, what is needed, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Unreadable(pub(crate) String);

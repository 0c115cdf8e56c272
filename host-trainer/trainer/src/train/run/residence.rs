//! Where the newest state of a run is: here, on a device, or in both.

use pocketsplat_kernels::step::LoadNumber;

/// Where the newest parameters, moments and statistics of a run are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Residence {
    /// Here alone.
    #[default]
    Host,
    /// Here and on the device.
    Both(LoadNumber),
    /// On the device alone; here, only the number of the anchors and their cells are right.
    Device(LoadNumber),
}

impl Residence {
    /// Whether nothing is newer on a device.
    pub(super) fn is_here(self) -> bool {
        !matches!(self, Self::Device(_))
    }

    /// Under which number a device took it.
    pub(super) fn load(self) -> Option<LoadNumber> {
        match self {
            Self::Host => None,
            Self::Both(load) | Self::Device(load) => Some(load),
        }
    }
}

//! What a bundle takes of the limits that it has to keep, and how much of a scene is to stay for that.

mod finished;
mod fit_to_limits;
mod limit_probe;
mod limit_shares;

pub use finished::Finished;
pub use fit_to_limits::Fit;
pub(crate) use fit_to_limits::Search;
pub(in crate::train) use fit_to_limits::{REWEIGHED_AT, fit, reweighed};
pub use limit_probe::{LimitProbe, MeasuredShares};
pub use limit_shares::LimitShares;

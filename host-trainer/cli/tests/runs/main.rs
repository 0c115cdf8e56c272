//! `pocketsplat train` through interruptions, full disks and accidents, as a user has them: with the program itself.
#![cfg(unix)]
#![expect(clippy::disallowed_macros, reason = "tests say what they skip")]

mod accidents;
#[path = "../../../../viewer/tests/chromium/mod.rs"]
mod chromium;
mod configuration;
mod device;
mod effects;
mod explicit;
mod export;
mod fixture;
mod gpu;
mod import;
mod interruption;
mod mistaken;
mod modules;
mod outputs;
mod plan;
mod poses;
mod preview;
mod remedies;
mod report;
mod similarity;
mod splats;
mod survey;
mod terminal;
mod view;
mod watch;

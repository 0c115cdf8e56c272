//! `pocketsplat train` through interruptions, full disks and accidents, as a user has them: with the program itself.
#![cfg(unix)]

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
mod interruption;
mod modules;
mod plan;
mod preview;
mod report;
mod splats;
mod sweep;
mod view;
mod watch;

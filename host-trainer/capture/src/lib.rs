//! Captures: photographs with poses, read from disk or drawn, in one normalised frame.
//!
//! [`dataset`] reads captures of every [`Layout`](dataset::Layout); [`synth`] writes a procedural one; both give views with a [`camera`].

pub mod camera;
pub mod dataset;
pub mod synth;

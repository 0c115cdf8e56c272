//! Captures: photographs with poses, read from disk or drawn, in one normalised frame.
//!
//! [`dataset`] reads the layouts of Blender, COLMAP, nerfstudio, Polycam, Record3D and NSVF; [`synth`] writes a procedural capture; both give views with
//! a [`camera`].

pub mod camera;
pub mod dataset;
pub mod synth;

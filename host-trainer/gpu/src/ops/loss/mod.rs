//! What training makes small beside the rate: differences from the photograph, and terms of the scene alone.

pub mod exposure;
pub mod high_pass;
pub mod l1;
pub mod normality;
pub mod opacity_target;
pub mod ssim;
pub mod target;
pub mod volume;

//! The camera models whose distortion can be undone.

/// For messages.
pub(super) const READABLE_MODELS: &str = "PINHOLE, SIMPLE_PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, \
                                          OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, SIMPLE_FISHEYE or \
                                          FISHEYE";

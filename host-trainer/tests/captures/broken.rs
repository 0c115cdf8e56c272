//! Broken captures.

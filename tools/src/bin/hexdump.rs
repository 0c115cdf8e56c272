//! Annotates a bundle.
fn main() {}

//! The `pocketsplat` command.

fn main() {}

//! Converts between the formats: `cargo run -p pocketsplat-gaussians --example convert IN OUT`.

use std::path::Path;

use pocketsplat_gaussians::Format;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [from, to] = [1, 2].map(|index| std::env::args().nth(index).unwrap_or_default());
    let (gaussians, notes) = pocketsplat_gaussians::read(Path::new(&from), None)?;
    let format = Format::of_path(Path::new(&to)).ok_or("the second name ends in .ply, .spz, .sog or .glb")?;
    std::fs::write(to, format.write(&gaussians, &notes)?.bytes)?;
    Ok(())
}

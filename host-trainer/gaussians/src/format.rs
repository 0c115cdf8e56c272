//! The formats that are written, and their names.

use std::path::Path;

/// A file format for Gaussians that is written as well as read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Every number in 32 bits.
    Ply,
    /// 8 to 24 bits a number, gzip around them.
    Spz,
    /// Images, a palette for what follows the view.
    Sog,
    /// Every number in 32 bits, for programs of glTF.
    Glb,
}

impl Format {
    /// All.
    pub const ALL: [Self; 4] = [Self::Ply, Self::Spz, Self::Sog, Self::Glb];

    /// What names end in, without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Spz => "spz",
            Self::Sog => "sog",
            Self::Glb => "glb",
        }
    }

    /// The format that a file's name says, whatever its case; `None` for names that say another thing, `.compressed.ply` among them.
    pub fn of_path(path: &Path) -> Option<Self> {
        const COMPRESSED: &str = ".compressed.ply";
        // The ending is text even where the rest of the name is none.
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let extension = path.extension()?.to_string_lossy();
        let is_written = !name.ends_with(COMPRESSED);
        Self::ALL.into_iter().find(|format| is_written && format.extension().eq_ignore_ascii_case(&extension))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compressed_ply_is_not_written() {
        let of = |name: &str| Format::of_path(Path::new(name));
        assert_eq!(
            (of("a.PLY"), of("a.b.spz"), of("a.compressed.ply"), of("a.gltf")),
            (Some(Format::Ply), Some(Format::Spz), None, None)
        );
        assert_eq!(of("a.Compressed.ply"), None);
    }

    #[cfg(unix)]
    #[test]
    fn the_ending_is_read_of_any_name() {
        use std::os::unix::ffi::OsStrExt as _;
        let of = |name: &[u8]| Format::of_path(Path::new(std::ffi::OsStr::from_bytes(name)));
        assert_eq!(
            (of(b"caf\xe9.ply"), of(b"caf\xe9.compressed.ply"), of(b"a.caf\xe9"), of(b"caf\xe9")),
            (Some(Format::Ply), None, None, None)
        );
    }
}

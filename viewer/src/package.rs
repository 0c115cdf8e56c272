//! The folder for web developers: the module, its JavaScript, types, a page and an example.

/// The WebAssembly module: this crate for `wasm32-unknown-unknown`.
pub const MODULE: &[u8] = include_bytes!("../pocketsplat.wasm");
pub(crate) const CHECK: &str = include_str!("../web/check.js");
pub(crate) const POCKETSPLAT: &str = include_str!("../web/pocketsplat.js");
pub(crate) const ORBIT: &str = include_str!("../web/orbit.js");
pub(crate) const VIEW: &str = include_str!("../web/view.js");
pub(crate) const MOTION: &str = include_str!("../web/motion.js");
pub(crate) const SHARPNESS: &str = include_str!("../web/sharpness.js");
pub(crate) const WORKER: &str = include_str!("../web/worker.js");

/// A file of the package.
#[derive(Clone, Copy, Debug)]
pub struct PackageFile {
    /// Its name in the folder.
    pub name: &'static str,
    /// Its content.
    pub bytes: &'static [u8],
}

/// The files of the package. Its example draws the bundle `scene.psb` beside them.
pub fn package() -> [PackageFile; 17] {
    const MANIFEST: &str = concat!(
        "{\n  \"name\": \"pocketsplat\",\n  \"version\": \"",
        env!("CARGO_PKG_VERSION"),
        "\",\n  \"description\": \"Draws pocketsplat bundles with the decoder that runs on microcontrollers\",\n  \"license\": \"",
        env!("CARGO_PKG_LICENSE"),
        "\",\n  \"repository\": \"",
        env!("CARGO_PKG_REPOSITORY"),
        "\",\n  \"type\": \"module\",\n  \"sideEffects\": [\"./element.js\", \"./worker.js\"],\n  \"exports\": {\n",
        "    \".\": { \"types\": \"./pocketsplat.d.ts\", \"default\": \"./pocketsplat.js\" },\n",
        "    \"./orbit\": { \"types\": \"./orbit.d.ts\", \"default\": \"./orbit.js\" },\n",
        "    \"./element\": { \"types\": \"./element.d.ts\", \"default\": \"./element.js\" },\n",
        "    \"./pocketsplat.wasm\": \"./pocketsplat.wasm\"\n  },\n  \"types\": \"./pocketsplat.d.ts\",\n",
        "  \"files\": [\"*.js\", \"*.d.ts\", \"*.wasm\", \"example.html\", \"LICENSE-*\"]\n}\n"
    );
    [
        ("pocketsplat.wasm", MODULE),
        ("pocketsplat.js", POCKETSPLAT.as_bytes()),
        ("pocketsplat.d.ts", include_bytes!("../web/pocketsplat.d.ts")),
        ("check.js", CHECK.as_bytes()),
        ("orbit.js", ORBIT.as_bytes()),
        ("orbit.d.ts", include_bytes!("../web/orbit.d.ts")),
        ("element.js", include_bytes!("../web/element.js")),
        ("element.d.ts", include_bytes!("../web/element.d.ts")),
        ("view.js", VIEW.as_bytes()),
        ("motion.js", MOTION.as_bytes()),
        ("sharpness.js", SHARPNESS.as_bytes()),
        ("worker.js", WORKER.as_bytes()),
        ("package.json", MANIFEST.as_bytes()),
        ("LICENSE-MIT", include_bytes!("../LICENSE-MIT")),
        ("LICENSE-APACHE", include_bytes!("../LICENSE-APACHE")),
        ("README.md", include_bytes!("../web/README.md")),
        ("example.html", include_bytes!("../web/example.html")),
    ]
    .map(|(name, bytes)| PackageFile { name, bytes })
}

#[cfg(test)]
mod tests {
    use pocketsplat_core::{Budget, Quality};

    use super::POCKETSPLAT;

    /// JavaScript refuses what the decoder would, before numbers are cut to the decoder's widths.
    #[test]
    fn the_limits_in_javascript_are_the_decoders() {
        for line in [
            format!("const MAX_FRAME_PX = {};", Budget::MAX_FRAME_PX),
            format!("const MAX_ALPHA_CUT = {};", Quality::MAX_ALPHA_CUT),
            format!("const MAX_TIERS = {};", u8::MAX),
        ] {
            assert!(POCKETSPLAT.contains(&line), "{line}");
        }
    }
}

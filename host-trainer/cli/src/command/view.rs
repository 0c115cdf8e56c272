//! `pocketsplat view`: a page that draws bundles in a browser.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use pocketsplat_core::Bundle;
use pocketsplat_viewer::{SceneFile, package, page};

use super::bundle::BundleFile;
use super::output;

/// Write one page that draws bundles in a browser, with nothing to install and nothing fetched.
///
/// The page turns the scene by mouse, touch and keys. Sliders set what a device has: memory, pruning rate, quality. It shows the plan and
/// the very pixels of the device. Several bundles stand side by side with one camera.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundles.
    #[arg(required = true, value_name = "SCENE.psb")]
    bundles: Vec<PathBuf>,
    /// The page to write.
    #[arg(short, long, value_name = "OUT.html", required_unless_present = "package")]
    output: Option<PathBuf>,
    /// Open the page in the desktop's browser.
    #[arg(long, requires = "output")]
    open: bool,
    /// Also write a folder for web developers: the decoder as WebAssembly, its JavaScript, types, an example that draws the first bundle.
    #[arg(long, value_name = "DIR")]
    package: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let files = args.bundles.iter().map(|path| BundleFile::read(path)).collect::<Result<Vec<_>>>()?;
    let bundles = files.iter().map(BundleFile::parse).collect::<Result<Vec<_>>>()?;
    if let Some(path) = &args.output {
        check_page(path)?;
    }
    if let (Some(folder), Some(first)) = (&args.package, files.first()) {
        write_package(folder, &first.bytes)?;
    }
    let Some(path) = &args.output else { return Ok(()) };
    write_page(path, &files, &bundles)?;
    if args.open { open(path) } else { Ok(()) }
}

/// Fails, before anything is written, where `path` can be no page.
fn check_page(path: &Path) -> Result<()> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension != "html" && extension != "htm" {
        bail!("{}: a page is written as .html; end the name in it", path.display());
    }
    output::check_writable(path)
}

fn write_page(path: &Path, files: &[BundleFile], bundles: &[Bundle<'_>]) -> Result<()> {
    let names = names(&files.iter().map(|file| file.path.as_path()).collect::<Vec<_>>());
    let scenes: Vec<SceneFile<'_>> =
        names.iter().zip(files).zip(bundles).map(|((name, file), bundle)| file.scene(name, bundle)).collect();
    let text = page(&names.join(" | "), &scenes);
    output::write_whole(path, text.as_bytes())?;
    println!("{}: {:.2} MB; open it in a browser", path.display(), text.len() as f64 / 1e6);
    Ok(())
}

/// What the page calls the files: their names without extension, with a number where another has the same.
fn names(paths: &[&Path]) -> Vec<String> {
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = |(i, path): (usize, &&Path)| {
        let before = paths[..i].iter().filter(|other| stem(other) == stem(path)).count();
        if before == 0 { stem(path) } else { format!("{} ({})", stem(path), before + 1) }
    };
    paths.iter().enumerate().map(name).collect()
}

fn write_package(folder: &Path, bundle: &[u8]) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("could not make the folder {}", folder.display()))?;
    let files = package().into_iter().map(|file| (file.name, file.bytes)).chain([("scene.psb", bundle)]);
    let files: Vec<(PathBuf, &[u8])> = files.map(|(name, bytes)| (folder.join(name), bytes)).collect();
    // A package that was written before is replaced, but nothing of somebody else's.
    let is_package = folder.join("pocketsplat.wasm").is_file();
    if let Some((path, _)) = files.iter().find(|(path, _)| path.exists() && !is_package) {
        bail!("{} exists already, in a folder that is no package; choose another --package", path.display());
    }
    for (path, bytes) in &files {
        output::write_whole(path, bytes)?;
    }
    println!("{}: {} files; README.md says how to use them", folder.display(), files.len());
    Ok(())
}

/// Hands the page to the desktop.
fn open(path: &Path) -> Result<()> {
    let has_desktop = cfg!(not(target_os = "linux"))
        || ["DISPLAY", "WAYLAND_DISPLAY"]
            .iter()
            .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()));
    if !has_desktop {
        bail!("there is no desktop here to open {}; open the file in a browser", path.display());
    }
    let path = fs::canonicalize(path).with_context(|| format!("could not find {}", path.display()))?;
    let program = match std::env::consts::OS {
        "macos" => "open",
        "windows" => "explorer",
        _ => "xdg-open",
    };
    Command::new(program)
        .arg(&path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .with_context(|| format!("could not start `{program}`; open {} in a browser", path.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::names;

    #[test]
    fn files_of_one_name_are_told_apart() {
        let paths = ["a/scene.psb", "b/scene.psb", "c.psb"].map(Path::new);
        assert_eq!(names(&paths), ["scene", "scene (2)", "c"]);
    }
}

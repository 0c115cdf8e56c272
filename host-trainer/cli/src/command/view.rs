//! `pocketsplat view`: a page that draws bundles in a browser, or shows splats from all around.

mod splats;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use pocketsplat_files::{Output, Outputs, shell_word, unused};
use pocketsplat_format::Bundle;
use pocketsplat_viewer::{SceneFile, package, page};

use super::bundle::BundleFile;
use super::gaussians::{AxesArgs, GaussiansFile};
use super::output;
use super::outputs::{ANYTHING, OverwriteArgs, PAGE, check_name};
use super::stand::StandArgs;
use crate::say::say;

/// Write a web page that draws bundles.
///
/// Nothing is installed and nothing fetched: it is one file. The page turns the scene by mouse, touch and keys. Sliders set what a device has: memory, pruning rate, quality. It shows the plan and
/// the very pixels of the device. Several bundles stand side by side with one camera. Of a .ply, .spz, .sog or .glb the page shows pictures of a turn
/// around it, and what the file holds.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundles, or one .ply, .spz, .sog or .glb.
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
    #[command(flatten)]
    overwrite: OverwriteArgs,
    #[command(flatten)]
    stand: StandArgs,
    #[command(flatten)]
    axes: AxesArgs,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    if let Some(path) = args.bundles.iter().find(|path| GaussiansFile::is_one(path)) {
        return run_splats(args, path);
    }
    args.stand.refuse("a bundle has a camera of its own")?;
    args.axes.refuse_unless(false, &args.bundles[0])?;
    let files = args.bundles.iter().map(|path| BundleFile::read(path)).collect::<Result<Vec<_>>>()?;
    let bundles = files.iter().map(BundleFile::parse).collect::<Result<Vec<_>>>()?;
    let mut outputs = args.bundles.iter().fold(args.overwrite.outputs(), |outputs, path| outputs.reading(path));
    let page = args.output.as_deref().map(|path| checked_page(path, &args.bundles[0], &mut outputs)).transpose()?;
    if let (Some(folder), Some(first)) = (&args.package, files.first()) {
        write_package(folder, &first.bytes, &mut outputs, args.overwrite)?;
    }
    let Some(page) = page else { return Ok(()) };
    write_page(&page, &files, &bundles)?;
    if args.open { open(page.path()) } else { Ok(()) }
}

/// Writes the page of one file of splats.
fn run_splats(args: &Args, splats: &Path) -> Result<()> {
    let (word, bundle) = (shell_word(splats), shell_word(&unused(Path::new("scene.psb"))));
    let Some(page) = &args.output else {
        bail!(
            "a package draws bundles, and {} holds splats; make a bundle with `pocketsplat import {word} -o {bundle}`",
            splats.display()
        );
    };
    if args.package.is_some() || args.bundles.len() > 1 {
        bail!(
            "a page shows bundles, or one file of splats alone; make a bundle of {} with `pocketsplat import {word} -o {bundle}`, or look \
             at it with `pocketsplat view {word} -o {}`",
            splats.display(),
            shell_word(page)
        );
    }
    let mut outputs = args.overwrite.outputs().reading(splats);
    let page = checked_page(page, splats, &mut outputs)?;
    let text = splats::page(splats, args.axes, &args.stand)?;
    write(&page, &text)?;
    if args.open { open(page.path()) } else { Ok(()) }
}

/// Fails, before anything is written, where `path` can be no page.
///
/// * `source`: what it shows.
fn checked_page(path: &Path, source: &Path, outputs: &mut Outputs) -> Result<Output> {
    check_name(path, PAGE, Some(source))?;
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension != "html" && extension != "htm" {
        bail!("{}: a page is written as .html; end the name in it", path.display());
    }
    Ok(outputs.file(path, PAGE)?)
}

fn write_page(output: &Output, files: &[BundleFile], bundles: &[Bundle<'_>]) -> Result<()> {
    let names = names(&files.iter().map(|file| file.path.as_path()).collect::<Vec<_>>());
    let scenes: Vec<SceneFile<'_>> =
        names.iter().zip(files).zip(bundles).map(|((name, file), bundle)| file.scene(name, bundle)).collect();
    write(output, &page(&names.join(" | "), &scenes))
}

fn write(page: &Output, text: &str) -> Result<()> {
    page.write(text.as_bytes())?;
    output::print_text(&format!("{}: {:.2} MB; open it in a browser\n", page.path().display(), text.len() as f64 / 1e6))
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

fn write_package(folder: &Path, bundle: &[u8], outputs: &mut Outputs, overwrite: OverwriteArgs) -> Result<()> {
    Outputs::folder(folder)?;
    let files = package().into_iter().map(|file| (file.name, file.bytes)).chain([("scene.psb", bundle)]);
    let files: Vec<(PathBuf, &[u8])> = files.map(|(name, bytes)| (folder.join(name), bytes)).collect();
    // A package that was written before is replaced, but nothing of somebody else's.
    let is_package = folder.join("pocketsplat.wasm").is_file() || overwrite.is_given();
    if let Some((path, _)) = files.iter().find(|(path, _)| path.exists() && !is_package) {
        bail!(
            "{} exists already, in a folder that is no package; choose another --package, or replace it with --overwrite",
            path.display()
        );
    }
    // Of what kind the files were is known: the folder is a package.
    let checked = files.iter().map(|(path, bytes)| Ok((outputs.file(path, ANYTHING)?, *bytes)));
    for (output, bytes) in checked.collect::<Result<Vec<_>>>()? {
        output.write(bytes)?;
    }
    output::print_text(&format!("{}: {} files; README.md says how to use them\n", folder.display(), files.len()))
}

/// Hands the page to the desktop.
fn open(path: &Path) -> Result<()> {
    let has_desktop = cfg!(not(target_os = "linux"))
        || ["DISPLAY", "WAYLAND_DISPLAY"]
            .iter()
            .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()));
    if !has_desktop {
        say!("warning: there is no desktop here to open {}; open the file in a browser", path.display());
        return Ok(());
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

//! .sog of PlayCanvas: a zip of `meta.json` and lossless WebP images, one pixel a Gaussian; or a folder of the same files.
//!
//! Versions 1 and 2 are read, 2 is written. Version 1 says no version, and has in place of codebooks the least and the largest number of
//! each channel.
//!
//! Gaussians are written along a Morton curve, so that neighbours in the scene are neighbours in the images. What it loses: centres keep
//! 16 bits of sign(x)·ln(|x| + 1) between the least and the largest, ln of scales and the constant colour are entries of codebooks of
//! 256, rotations keep 8 bits a part, opacities 8, and all other harmonics of a Gaussian are one of at most 65,536 palette entries.
//!
//! Its specification names axes x right, y up, z back; the programs that write it keep the axes of the .ply they read (checked with
//! splat-transform 2.7.1), and so do reader and writer here.

mod codebook;
mod files;
mod image_bytes;
mod meta;
mod morton;
mod palette;
mod rotation;
#[cfg(test)]
mod tests;
mod zip;

use std::path::Path;

use crate::account::Account;
use crate::opacity::byte_of_logit;
use crate::{Degree, Gaussians, Notes, Unreadable};
use codebook::Codebook;
use files::Files;
use image_bytes::Pixels;
use meta::{Asset, Meta};
pub(crate) use morton::order;
use palette::Palette;

/// Palette entries in one row of `shN_centroids`.
const ENTRIES_IN_A_ROW: usize = 64;

/// Largest palette: what 16 bits can name.
const MAX_PALETTE: usize = 1 << 16;

/// Writes version 2; its Gaussians come in the order of a Morton curve through their centres.
///
/// # Errors
/// [`Unreadable`] for no Gaussian at all, and for more than images of 16,383 × 16,383 pixels hold.
pub fn write(gaussians: &Gaussians, notes: &Notes) -> Result<Vec<u8>, Unreadable> {
    if gaussians.is_empty() {
        return Err(Unreadable::new("would hold no Gaussian; an image of a .sog has one pixel at least"));
    }
    let order = morton::order(&gaussians.centres);
    let mut files = Vec::new();
    let mut add = |name: &str, pixels: &Pixels| -> Result<(), Unreadable> {
        files.push((name.to_owned(), pixels.to_webp()?));
        Ok(())
    };
    let image = |pixel: &dyn Fn(usize) -> [u8; 4]| Pixels::of_gaussians(order.iter().map(|&index| pixel(index)));

    let (mins, maxs) = extent(&gaussians.centres);
    let fixed = |index: usize| -> [u16; 3] {
        std::array::from_fn(|axis| {
            let range = maxs[axis] - mins[axis];
            let share = if range > 0.0 { (log(gaussians.centres[index][axis]) - mins[axis]) / range } else { 0.0 };
            // Casts saturate.
            (share * 65_535.0).round() as u16
        })
    };
    let bytes_of = |index: usize, which: usize| {
        let [x, y, z] = fixed(index).map(|value| value.to_le_bytes()[which]);
        [x, y, z, 255]
    };
    add("means_l.webp", &image(&|index| bytes_of(index, 0)))?;
    add("means_u.webp", &image(&|index| bytes_of(index, 1)))?;
    add("quats.webp", &image(&|index| rotation::pack(gaussians.rotations[index])))?;

    let scales = Codebook::of(gaussians.log_scales.iter().flatten().copied());
    let triple = |book: &Codebook, values: [f32; 3]| values.map(|value| book.index_of(value));
    add(
        "scales.webp",
        &image(&|index| {
            let [x, y, z] = triple(&scales, gaussians.log_scales[index]);
            [x, y, z, 255]
        }),
    )?;
    let colours = Codebook::of((0..gaussians.len()).flat_map(|index| gaussians.harmonics_of(index)[0]));
    add(
        "sh0.webp",
        &image(&|index| {
            let [red, green, blue] = triple(&colours, gaussians.harmonics_of(index)[0]);
            [red, green, blue, byte_of_logit(gaussians.opacity_logits[index])]
        }),
    )?;

    let mut others = None;
    if gaussians.degree > Degree::Zero {
        let palette = Palette::of(gaussians, &order);
        let book = Codebook::of(palette.entries.iter().flatten().flatten().copied());
        let n_rest = gaussians.degree.n_coefficients() - 1;
        let pixels = palette.entries.iter().flat_map(|entry| {
            entry.iter().map(|&colour| {
                let [red, green, blue] = triple(&book, colour);
                [red, green, blue, 255]
            })
        });
        add("shN_centroids.webp", &Pixels::of_rows(ENTRIES_IN_A_ROW * n_rest, pixels))?;
        add(
            "shN_labels.webp",
            &image(&|index| {
                let [low, high] = palette.labels[index].to_le_bytes();
                [low, high, 0, 255]
            }),
        )?;
        others = Some(meta::Harmonics {
            count: palette.entries.len(),
            bands: gaussians.degree.number(),
            codebook: book.values().to_vec(),
            files: ["shN_centroids.webp".to_owned(), "shN_labels.webp".to_owned()],
        });
    }
    let meta = Meta {
        version: meta::VERSION,
        asset: Some(Asset {
            generator: "pocketsplat".to_owned(),
            frame: (!notes.frame.is_identity()).then(|| notes.frame.numbers()),
        }),
        count: gaussians.len(),
        antialias: notes.compensation,
        means: meta::Means { mins, maxs, files: ["means_l.webp".to_owned(), "means_u.webp".to_owned()] },
        scales: meta::Coded::new(scales.values().to_vec(), "scales.webp"),
        quats: meta::Files { files: ["quats.webp".to_owned()] },
        sh0: meta::Coded::new(colours.values().to_vec(), "sh0.webp"),
        others,
    };
    files.push(("meta.json".to_owned(), serde_json::to_vec(&meta).expect("plain numbers and names")));
    zip::write(&files)
}

/// sign(x)·ln(|x| + 1), in 64 bits so that what is near 0 stays there.
fn log(coordinate: f32) -> f64 {
    f64::from(coordinate).abs().ln_1p().copysign(f64::from(coordinate))
}

/// Least and largest of each axis, as [`log`] has them.
fn extent(centres: &[[f32; 3]]) -> ([f64; 3], [f64; 3]) {
    let (mut mins, mut maxs) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for centre in centres {
        for axis in 0..3 {
            mins[axis] = mins[axis].min(log(centre[axis]));
            maxs[axis] = maxs[axis].max(log(centre[axis]));
        }
    }
    (mins, maxs)
}

/// Reads a bundled file.
///
/// # Errors
/// [`Unreadable`] for other versions, and for what is cut off, damaged, or unpacks to more than a scene could: memory follows the bytes
/// that are there.
pub fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    read_files(&Files::Zip(zip::Archive::open(bytes)?, bytes.len()))
}

/// Reads the files of a folder, `meta.json` and the images that it names.
///
/// # Errors
/// As [`read`], and for files that are missing or lie elsewhere.
pub fn read_folder(folder: &Path) -> Result<(Gaussians, Notes), Unreadable> {
    read_files(&Files::Folder(folder))
}

/// Where the bytes of a bundled file went.
pub(crate) fn account(bytes: &[u8]) -> Result<Account, Unreadable> {
    account_of(&Files::Zip(zip::Archive::open(bytes)?, bytes.len()), ".sog")
}

/// Where the bytes of a folder's files went.
pub(crate) fn account_of_folder(folder: &Path) -> Result<Account, Unreadable> {
    account_of(&Files::Folder(folder), "unbundled .sog")
}

fn account_of(files: &Files<'_>, kind: &str) -> Result<Account, Unreadable> {
    let json = files.read("meta.json")?;
    let meta = Meta::parse(&json)?;
    let mut parts = vec![("meta.json", json.len())];
    for name in meta.files() {
        parts.push((name, files.read(name)?.len()));
    }
    Ok(Account::new(format!("{kind}, version {}", meta.version), None, &parts))
}

fn read_files(files: &Files<'_>) -> Result<(Gaussians, Notes), Unreadable> {
    let meta = Meta::parse(&files.read("meta.json")?)?;
    let load = |name: &String| {
        let bytes = files.read(name)?;
        Pixels::from_webp(name, &bytes, files.n_bytes().unwrap_or(bytes.len()))
    };
    let of_gaussians = |name: &String| load(name)?.at_least(name, meta.count);
    let [low, high] = [of_gaussians(&meta.means.files[0])?, of_gaussians(&meta.means.files[1])?];
    let quats = of_gaussians(&meta.quats.files[0])?;
    let scales = of_gaussians(&meta.scales.files[0])?;
    let sh0 = of_gaussians(&meta.sh0.files[0])?;
    let degree = meta.degree();
    let others = match &meta.others {
        Some(others) => {
            let (centroids, labels) = others.centroids_and_labels();
            let n_rest = degree.n_coefficients() - 1;
            let n_pixels = others.count.div_ceil(ENTRIES_IN_A_ROW) * ENTRIES_IN_A_ROW * n_rest;
            // The last row may end with its last entry in programs that crop; what is missing is found when an entry is looked up.
            let image =
                load(centroids)?.of_width(centroids, ENTRIES_IN_A_ROW * n_rest)?.at_least(centroids, n_pixels)?;
            let n_entries = if meta.version == 1 { image.len() / n_rest } else { others.count };
            Some((others.table()?, image, of_gaussians(labels)?, n_entries))
        }
        None => None,
    };
    let (scale_tables, sh0_tables) = (meta.scale_tables()?, meta.sh0_tables()?);
    let look_up = |tables: &[Vec<f32>], pixel: [u8; 4]| -> [f32; 3] {
        std::array::from_fn(|channel| tables[channel][usize::from(pixel[channel])])
    };

    let mut gaussians = Gaussians { degree, ..Gaussians::default() };
    for index in 0..meta.count {
        gaussians.centres.push(std::array::from_fn(|axis| {
            let fixed = f64::from(u16::from_le_bytes([low.rgba(index)[axis], high.rgba(index)[axis]])) / 65_535.0;
            let value = meta.means.mins[axis] + fixed * (meta.means.maxs[axis] - meta.means.mins[axis]);
            (value.abs().exp_m1().copysign(value)) as f32
        }));
        gaussians.rotations.push(rotation::unpack(quats.rgba(index)).ok_or_else(|| {
            Unreadable::new(format!(
                "has {} for the kind of rotation {index}, which has to be from 252 to 255",
                quats.rgba(index)[3]
            ))
        })?);
        gaussians.log_scales.push(look_up(&scale_tables, scales.rgba(index)));
        gaussians.harmonics.push(look_up(&sh0_tables, sh0.rgba(index)));
        gaussians.opacity_logits.push(sh0_tables[3][usize::from(sh0.rgba(index)[3])]);
        if let Some((table, centroids, labels, n_entries)) = &others {
            let [low, high, ..] = labels.rgba(index);
            let label = usize::from(u16::from_le_bytes([low, high]));
            if label >= *n_entries {
                return Err(Unreadable::new(format!(
                    "has palette entry {label} for Gaussian {index}, of {n_entries} entries"
                )));
            }
            let n_rest = degree.n_coefficients() - 1;
            for number in 0..n_rest {
                let [red, green, blue, _] =
                    centroids.rgba(label * n_rest + number).map(|byte| table[usize::from(byte)]);
                gaussians.harmonics.push([red, green, blue]);
            }
        }
    }
    let (gaussians, warnings) = gaussians.meant()?;
    let frame = meta.frame().unwrap_or_default();
    Ok((gaussians, Notes { compensation: meta.antialias, frame, warnings, ..Notes::default() }))
}

/// Writes the files of a bundled one beside each other.
#[cfg(test)]
pub(crate) fn unpack_for_tests(bytes: &[u8], folder: &Path) {
    let archive = zip::Archive::open(bytes).expect("ours");
    let meta = Meta::parse(&archive.file("meta.json").expect("there")).expect("ours");
    for name in meta.files().map(str::to_owned).chain(["meta.json".to_owned()]) {
        std::fs::write(folder.join(&name), archive.file(&name).expect("there")).expect("room");
    }
}

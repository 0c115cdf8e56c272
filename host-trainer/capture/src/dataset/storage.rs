//! Where the pixels of a capture lie once it is loaded: in memory, in a cache, or where they are.

use rayon::prelude::*;

use super::cache::{Cache, CachedPhoto};
use super::framing::Framing;
use super::listing::{ListedView, Shot};
use super::looks::Looks;
use super::photo::Photo;
use super::view::SourceFile;
use super::{DatasetError, LoadOptions, Split, View, ViewFault, remove_cache};

/// Memory for images that are being decoded, where the capture is not held in memory; one is decoded however large.
const DECODING_BYTES: u64 = 384 << 20;
/// A pixel as it is stored takes four bytes decoded, three composited, and eight where it is undistorted.
const BYTES_PER_SOURCE_PIXEL: u64 = 15;
/// A pixel of what is kept takes three sums of eight bytes while it is reduced, and three bytes and its mask thrice.
const BYTES_PER_PIXEL: u64 = 36;

/// Where the pixels go.
enum Storage {
    Memory,
    Cache(Cache),
    /// Nowhere; they are decoded again.
    Capture,
}

/// A view of the capture, its cameras in capture units, or why there is none.
pub(super) struct LoadedView {
    pub(super) split: Split,
    pub(super) name: String,
    /// With what its photograph looks like.
    pub(super) view: Result<(View, Looks), ViewFault>,
}

/// Decodes every view once, and keeps the pixels in memory where all of them take no more than
/// [`LoadOptions::in_memory_bytes`].
///
/// # Errors
/// Those of the [`Cache`].
pub(super) fn load_views(views: Vec<ListedView>, options: &LoadOptions) -> Result<Vec<LoadedView>, DatasetError> {
    let storage = Storage::of(&views, options)?;
    let load = |(i, listed): (usize, ListedView)| -> Result<LoadedView, DatasetError> {
        let ListedView { split, name, shot, .. } = listed;
        let view = match shot {
            Ok(shot) => storage.view(i, &name, shot, options)?,
            Err(fault) => Err(fault),
        };
        Ok(LoadedView { split, name, view })
    };
    if let Storage::Memory = storage {
        return views.into_par_iter().enumerate().map(load).collect();
    }
    // As many runs of views as images may be decoded at the same time, one after another in each.
    let n_at_once = n_decoded_at_once(&views, options).clamp(1, views.len().max(1));
    let each = views.len().div_ceil(n_at_once).max(1);
    let mut numbered = views.into_iter().enumerate();
    let runs: Vec<Vec<_>> =
        std::iter::from_fn(|| Some(numbered.by_ref().take(each).collect()).filter(|run: &Vec<_>| !run.is_empty()))
            .collect();
    let loaded: Vec<Vec<LoadedView>> =
        runs.into_par_iter().map(|run| run.into_iter().map(load).collect()).collect::<Result<_, _>>()?;
    Ok(loaded.into_iter().flatten().collect())
}

/// Images for which [`DECODING_BYTES`] suffice, whichever they are.
fn n_decoded_at_once(views: &[ListedView], options: &LoadOptions) -> usize {
    let pixels = |(width, height): (u32, u32)| u64::from(width) * u64::from(height);
    let bytes = |shot: &Shot| {
        let kept_px = Framing::of(shot.header.size_px, options).map_or((0, 0), |framing| framing.size_px);
        BYTES_PER_SOURCE_PIXEL * pixels(shot.header.size_px) + BYTES_PER_PIXEL * pixels(kept_px)
    };
    let largest = views.iter().filter_map(|view| view.shot.as_ref().ok()).map(bytes).max().unwrap_or(1);
    usize::try_from(DECODING_BYTES / largest.max(1)).unwrap_or(usize::MAX)
}

impl Storage {
    fn of(views: &[ListedView], options: &LoadOptions) -> Result<Self, DatasetError> {
        let shots = views.iter().filter_map(|view| view.shot.as_ref().ok());
        let needed: u64 = shots.map(|shot| shot.decoded_bytes(options)).sum();
        match &options.cache {
            Some(folder) if needed > options.in_memory_bytes => Ok(Self::Cache(Cache::open(folder, needed)?)),
            None if needed > options.in_memory_bytes => Ok(Self::Capture),
            _ => {
                if let Some(folder) = &options.cache {
                    // An earlier load with larger images may have left one. What stays costs room and nothing else.
                    let _ = remove_cache(folder);
                }
                Ok(Self::Memory)
            }
        }
    }

    fn view(
        &self,
        i: usize,
        name: &str,
        shot: Shot,
        options: &LoadOptions,
    ) -> Result<Result<(View, Looks), ViewFault>, DatasetError> {
        let name = name.to_owned();
        if let Self::Cache(cache) = self {
            let framing = match shot.framing(options) {
                Ok(framing) => framing,
                Err(fault) => return Ok(Err(fault)),
            };
            return Ok(cache
                .photo(i, &name, &shot, options)?
                .map(|CachedPhoto { file, looks }| (View::in_cache(name, shot.camera(&framing), file), looks)));
        }
        Ok(shot.read(options).map(|Photo { photograph, camera, looks, .. }| match self {
            Self::Capture => {
                let (crc32, has_mask) = (photograph.crc32(), photograph.mask.is_some());
                let file = SourceFile { shot, options: options.clone(), crc32, has_mask };
                (View::in_capture(name, camera, file), looks)
            }
            _ => (View::new(name, camera, photograph), looks),
        }))
    }
}

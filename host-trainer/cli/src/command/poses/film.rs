//! What a film is, as `ffprobe` says it, and how its frames are asked for.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_files::shown;
use serde::Deserialize;

use super::programs::FFPROBE;

/// Longest side of the grey images that sharpness and motion are measured on, px.
const MEASURED_PX: u32 = 640;
/// Candidates for each frame that is wanted: so many are compared for sharpness.
const CANDIDATES: f64 = 5.0;

/// A film.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Film {
    pub(super) path: PathBuf,
    /// As it is shown: after the rotation that its metadata ask for.
    pub(super) size_px: (u32, u32),
    pub(super) duration_s: f64,
    pub(super) frames_per_s: f64,
    pub(super) range: Range,
}

/// How bright its pixels may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Range {
    Standard,
    /// HDR by the curve of this name: HLG or PQ.
    High(&'static str),
}

#[derive(Debug, Deserialize)]
struct Probed {
    #[serde(default)]
    streams: Vec<Stream>,
    #[serde(default)]
    format: Format,
}

#[derive(Debug, Default, Deserialize)]
struct Format {
    duration: Option<String>,
}

#[derive(Debug, Deserialize)]
struct Stream {
    width: Option<u32>,
    height: Option<u32>,
    avg_frame_rate: Option<String>,
    r_frame_rate: Option<String>,
    duration: Option<String>,
    color_transfer: Option<String>,
    #[serde(default)]
    side_data_list: Vec<SideData>,
    #[serde(default)]
    tags: Tags,
}

#[derive(Debug, Deserialize)]
struct SideData {
    rotation: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
struct Tags {
    /// Of old versions of `ffprobe`.
    rotate: Option<String>,
}

impl Film {
    pub(super) fn read(path: &Path) -> Result<Self> {
        let options = ["-v", "error", "-select_streams", "v:0", "-show_streams", "-show_format", "-of", "json"];
        let path_as_is = path_argument(path);
        let said = FFPROBE.says(options.iter().map(OsStr::new).chain([path_as_is.as_os_str()]))?;
        if !said.status.success() {
            let why = String::from_utf8_lossy(&said.stderr).trim().to_owned();
            bail!("`{}` cannot be read as a film: {why}; copy or download it again", shown(path));
        }
        Self::parse(path, &said.stdout)
    }

    fn parse(path: &Path, json: &[u8]) -> Result<Self> {
        let shown = shown(path);
        let probed: Probed =
            serde_json::from_slice(json).with_context(|| format!("could not read what `ffprobe` says of `{shown}`"))?;
        let Some(stream) = probed.streams.first() else {
            bail!("`{shown}` holds no pictures; give a film");
        };
        let (Some(width), Some(height)) = (stream.width, stream.height) else {
            bail!("`ffprobe` finds no size of the pictures in `{shown}`; convert it with `ffmpeg` and give that");
        };
        let turns = stream.side_data_list.iter().find_map(|data| data.rotation);
        let turns = turns.or(stream.tags.rotate.as_ref().and_then(|degrees| degrees.parse().ok())).unwrap_or(0.0);
        let is_on_side = (turns / 90.0).round().rem_euclid(2.0) == 1.0;
        let duration = stream.duration.as_ref().or(probed.format.duration.as_ref());
        let duration_s = duration.and_then(|seconds| seconds.parse().ok()).filter(|seconds| *seconds > 0.0);
        let Some(duration_s) = duration_s else {
            bail!("`ffprobe` does not say how long `{shown}` is; convert it with `ffmpeg` and give that");
        };
        let rates = [&stream.avg_frame_rate, &stream.r_frame_rate];
        let frames_per_s = rates.into_iter().flatten().find_map(|rate| rate_in(rate)).unwrap_or(25.0);
        let range = match stream.color_transfer.as_deref() {
            Some("arib-std-b67") => Range::High("arib-std-b67"),
            Some("smpte2084") => Range::High("smpte2084"),
            _ => Range::Standard,
        };
        let size_px = if is_on_side { (height, width) } else { (width, height) };
        Ok(Self { path: path.to_owned(), size_px, duration_s, frames_per_s, range })
    }

    /// Candidates in a second where so many frames are wanted of the film: no more than it has.
    pub(super) fn candidates_per_s(&self, n_wanted: usize) -> f64 {
        (CANDIDATES * n_wanted as f64 / self.duration_s).min(self.frames_per_s)
    }

    /// The size in which candidates are measured: in proportion, even, no larger than the film.
    pub(super) fn measured_px(&self) -> (u32, u32) {
        let (width, height) = self.size_px;
        let scale = (f64::from(MEASURED_PX) / f64::from(width.max(height))).min(1.0);
        let even = |side: u32| (((f64::from(side) * scale / 2.0).round() as u32) * 2).max(2);
        (even(width), even(height))
    }

    /// Filters of `ffmpeg` that give 8-bit colours as JPEG has them: BT.601, all values from 0 to 255.
    ///
    /// HDR: paper white (203 cd/m², ITU-R BT.2408) becomes white, what is darker than 0.8 of it keeps its brightness, and what is
    /// brighter is compressed.
    pub(super) fn to_8_bit(&self) -> String {
        match self.range {
            Range::Standard => "scale=out_color_matrix=bt601:out_range=full,format=yuvj420p".to_owned(),
            Range::High(curve) => format!(
                "zscale=tin={curve}:pin=2020:min=2020_ncl:t=linear:npl=203,format=gbrpf32le,zscale=p=bt709,\
                 tonemap=mobius:param=0.8:desat=0,zscale=t=bt709:m=170m:r=full,format=yuvj420p"
            ),
        }
    }
}

/// The path as `ffmpeg` takes it for a file, whatever it is called: neither an option nor a protocol.
pub(super) fn path_argument(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// `30000/1001`, frames in a second.
fn rate_in(text: &str) -> Option<f64> {
    let (n, seconds) = text.split_once('/').unwrap_or((text, "1"));
    let rate = n.parse::<f64>().ok()? / seconds.parse::<f64>().ok()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(json: &str) -> Result<Film> {
        Film::parse(Path::new("walk.mp4"), json.as_bytes())
    }

    #[test]
    fn a_film_on_its_side_is_as_it_is_shown() {
        let film = parsed(
            r#"{"streams": [{"width": 1920, "height": 1080, "avg_frame_rate": "30000/1001", "r_frame_rate": "30/1",
                "duration": "12.5", "color_transfer": "bt709", "side_data_list": [{"side_data_type": "Display Matrix", "rotation": -90}]}],
                "format": {"duration": "12.6"}}"#,
        )
        .unwrap();
        assert_eq!((film.size_px, film.duration_s, film.range), ((1080, 1920), 12.5, Range::Standard));
        assert!((film.frames_per_s - 29.97).abs() < 0.001);
        assert_eq!(film.measured_px(), (360, 640));
        assert!((film.candidates_per_s(25) - 10.0).abs() < 1e-9);
        assert!((film.candidates_per_s(250) - 29.97).abs() < 0.001, "no more than it has");
        let tagged = r#"{"streams": [{"width": 64, "height": 48, "avg_frame_rate": "0/0", "r_frame_rate": "25/1",
            "tags": {"rotate": "270"}}], "format": {"duration": "2"}}"#;
        let film = parsed(tagged).unwrap();
        assert_eq!((film.size_px, film.duration_s, film.frames_per_s), ((48, 64), 2.0, 25.0));
        assert_eq!(film.measured_px(), (48, 64), "never enlarged");
    }

    #[test]
    fn hdr_is_known_by_its_curve_and_mapped() {
        for curve in ["arib-std-b67", "smpte2084"] {
            let json = format!(
                r#"{{"streams": [{{"width": 64, "height": 48, "duration": "1", "color_transfer": "{curve}"}}]}}"#
            );
            let film = parsed(&json).unwrap();
            assert_eq!(film.range, Range::High(curve));
            assert!(film.to_8_bit().contains(&format!("tin={curve}")) && film.to_8_bit().contains("tonemap"));
        }
    }

    #[test]
    fn what_is_no_film_is_refused_with_a_remedy() {
        for (json, said) in [
            ("{}", "holds no pictures; give a film"),
            (r#"{"streams": [{"width": 4, "height": 4}]}"#, "does not say how long"),
            (r#"{"streams": [{"duration": "1"}]}"#, "no size of the pictures"),
        ] {
            let error = parsed(json).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}

//! Frames of films, chosen and written as JPEG.

use std::path::Path;

use anyhow::{Result, bail};
use pocketsplat_files::shown;
use serde::{Deserialize, Serialize};

use super::child::{Ended, Work};
use super::choice::{Measure, choose};
use super::film::{Film, Range, path_argument};
use super::programs::FFMPEG;
use super::progress::Progress;
use crate::say::say;

/// Frames of a second of film, where nobody says how many.
const FRAMES_PER_S: f64 = 3.0;
/// Frames of all films, where nobody says how many: what one side of a thing takes, and a room.
const USUAL: (usize, usize) = (30, 150);
/// Fewer than these are no capture.
pub(super) const FEWEST: usize = 3;

/// A photograph, and where it comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Taken {
    /// As it is called in `images`.
    pub(super) name: String,
    /// The file that it was made of.
    pub(super) from: String,
    /// When in the film it was, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) at_s: Option<f64>,
}

/// How many frames are taken of films of this length.
pub(super) fn n_frames(asked: Option<usize>, duration_s: f64) -> usize {
    asked.unwrap_or_else(|| ((FRAMES_PER_S * duration_s).round() as usize).clamp(USUAL.0, USUAL.1))
}

/// Takes the frames of all films; `None` where it was stopped.
///
/// Each film gets its share by length. Frames are named in order, `frame_0001.jpg` first.
pub(super) fn frames(
    films: &[Film],
    asked: Option<usize>,
    images: &Path,
    work: Work<'_>,
) -> Result<Option<Vec<Taken>>> {
    let duration_s = films.iter().map(|film| film.duration_s).sum::<f64>();
    let n_wanted = n_frames(asked, duration_s);
    let mut taken = Vec::new();
    for film in films {
        let share = ((n_wanted as f64 * film.duration_s / duration_s).round() as usize).max(1);
        let Some(of_film) = frames_of(film, share, taken.len(), images, work)? else { return Ok(None) };
        taken.extend(of_film);
    }
    if taken.len() < FEWEST {
        let names: Vec<String> = films.iter().map(|film| shown(&film.path)).collect();
        bail!(
            "the camera hardly moves in {}: {} frames differ, needed: at least {FEWEST}; walk around the subject while you film",
            names.join(", "),
            taken.len()
        );
    }
    Ok(Some(taken))
}

/// * `n_before`: frames of the films before.
fn frames_of(
    film: &Film,
    n_wanted: usize,
    n_before: usize,
    images: &Path,
    work: Work<'_>,
) -> Result<Option<Vec<Taken>>> {
    let from = shown(&film.path);
    if let Range::High(curve) = film.range {
        let name = if curve == "smpte2084" { "PQ" } else { "HLG" };
        say!("{from} is HDR ({name}): its frames become 8 bit, and what is brighter than paper white is compressed");
    }
    let rate = film.candidates_per_s(n_wanted);
    let (width, height) = film.measured_px();
    let mut command = FFMPEG.command();
    command.args(["-nostdin", "-v", "error", "-i"]).arg(path_argument(&film.path)).args(["-map", "0:v:0"]);
    command.args(["-vf", &format!("fps={rate:.6},scale={width}:{height}:flags=area,format=gray")]);
    command.args(["-f", "rawvideo", "-"]);
    let mut progress = Progress::new("frames looked at", (film.duration_s * rate).round().max(1.0) as usize);
    let (mut measure, mut candidates) = (Measure::default(), Vec::new());
    let ended = work.read(command, width as usize * height as usize, |grey| {
        candidates.push(measure.next(grey, width as usize));
        progress.reached(candidates.len());
        Ok(())
    })?;
    drop(progress);
    if !is_good(&ended, &from, work)? {
        return Ok(None);
    }
    let chosen = choose(&candidates, n_wanted);
    let mut command = FFMPEG.command();
    command.args(["-nostdin", "-v", "error", "-y", "-i"]).arg(path_argument(&film.path)).args(["-map", "0:v:0"]);
    // Behind the choice time is counted anew, one frame a tick: nothing is left out or doubled to keep a rate. (Ticks of `fps` are as long
    // as its frames, so a time in them would be rounded.)
    let filters = format!("fps={rate:.6},select={},settb=1/25,setpts=N,{}", is_one_of(&chosen), film.to_8_bit());
    command.args(["-vf", &filters, "-r", "25", "-q:v", "2", "-start_number", &(n_before + 1).to_string()]);
    // A name with `%` would be taken for a pattern, so the program works in the folder.
    command.current_dir(images).arg("frame_%04d.jpg");
    if !is_good(&work.run(command, |_| {})?, &from, work)? {
        return Ok(None);
    }
    say!("{from}: {} of {} frames taken, the sharpest at an even overlap", chosen.len(), candidates.len());
    let frame = |(i, candidate): (usize, &usize)| Taken {
        name: format!("frame_{:04}.jpg", n_before + i + 1),
        from: film.path.file_name().map_or(from.clone(), |name| name.to_string_lossy().into_owned()),
        at_s: Some((*candidate as f64 / rate * 1000.0).round() / 1000.0),
    };
    let taken: Vec<Taken> = chosen.iter().enumerate().map(frame).collect();
    if let Some(missing) = taken.iter().find(|frame| !images.join(&frame.name).is_file()) {
        bail!("`ffmpeg` left out {} of {from}; its words are in {}", missing.name, work.log.path().display());
    }
    Ok(Some(taken))
}

/// Whether it ended well; not if it was stopped.
fn is_good(ended: &Ended, film: &str, work: Work<'_>) -> Result<bool> {
    match ended {
        Ended::Well => Ok(true),
        Ended::Stopped => Ok(false),
        Ended::Badly(status) => bail!(
            "`ffmpeg` could not take frames out of {film} ({status}); why stands at the end of {}",
            work.log.path().display()
        ),
    }
}

/// An expression of `ffmpeg` that is 1 for frames of these numbers: halved again and again, for its sums have at most a hundred terms.
fn is_one_of(numbers: &[usize]) -> String {
    match numbers {
        [] => "0".to_owned(),
        [n] => format!("eq(n\\,{n})"),
        _ => {
            let (a, b) = numbers.split_at(numbers.len() / 2);
            format!("({}+{})", is_one_of(a), is_one_of(b))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_gives_three_frames_a_second_within_limits() {
        assert_eq!(n_frames(None, 0.2), 30);
        assert_eq!(n_frames(None, 20.0), 60);
        assert_eq!(n_frames(None, 600.0), 150);
        assert_eq!(n_frames(Some(40), 600.0), 40);
    }

    #[test]
    fn numbers_of_frames_are_asked_for_by_halves() {
        assert_eq!(is_one_of(&[3, 5, 8]), "(eq(n\\,3)+(eq(n\\,5)+eq(n\\,8)))");
        let many: Vec<usize> = (0..1000).collect();
        let depth = is_one_of(&many).split(|c| c != '(').map(str::len).max();
        assert!(depth.is_some_and(|depth| depth <= 12), "{depth:?}");
    }

    /// Films of moving test pictures, or `None` where there is no `ffmpeg` that makes them.
    fn made(folder: &Path, name: &str, options: &[&str]) -> Option<Film> {
        let path = folder.join(name);
        let mut command = FFMPEG.command();
        command.args(["-nostdin", "-v", "error", "-y"]).args(options).arg(&path);
        if command.status().is_ok_and(|status| status.success()) {
            return Some(Film::read(&path).unwrap());
        }
        assert!(std::env::var_os("POCKETSPLAT_NEEDS_COLMAP").is_none(), "no ffmpeg makes {name}");
        say!("SKIPPED: no ffmpeg makes {name}; `apt-get install ffmpeg`");
        None
    }

    const PICTURES: [&str; 4] = ["-f", "lavfi", "-i", "testsrc2=s=128x96:r=10:d=2"];

    fn taken_of(film: Film, images: &Path) -> Vec<Taken> {
        some_taken_of(film, 5, images)
    }

    fn some_taken_of(film: Film, n: usize, images: &Path) -> Vec<Taken> {
        let folder = tempfile::tempdir().unwrap();
        let log = crate::command::poses::log::Log::open(&folder.path().join("poses.log")).unwrap();
        let stop = std::sync::atomic::AtomicBool::new(false);
        frames(&[film], Some(n), images, Work { log: &log, stop: &stop }).unwrap().unwrap()
    }

    /// Of few looks a second and many frames, as a long film has them.
    #[test]
    fn frames_are_those_of_their_times_whatever_the_rate() {
        let home = tempfile::tempdir().unwrap();
        let options = ["-f", "lavfi", "-i", "testsrc2=s=64x48:r=30:d=37", "-g", "30", "-pix_fmt", "yuv420p"];
        let Some(film) = made(home.path(), "long.mp4", &options) else { return };
        let rate = film.candidates_per_s(40);
        assert!(rate < 9.0 && 25.0 % rate > 0.1, "{rate}");
        let film_path = film.path.clone();
        let taken = some_taken_of(film, 40, home.path());
        assert!(taken.len() > 30, "{}", taken.len());
        let pixels = |name: &str| image::open(home.path().join(name)).unwrap().into_rgb8();
        for Taken { name, at_s, .. } in taken.iter().step_by(5) {
            let found = pixels(name);
            let off_from = |number: f64| {
                let select = format!("fps={rate:.6},select=eq(n\\,{number})");
                let picture = home.path().join("looked-at.png");
                let _ = std::fs::remove_file(&picture);
                let mut command = FFMPEG.command();
                command.args(["-nostdin", "-v", "error", "-y", "-i"]).arg(&film_path);
                assert!(command.args(["-vf", &select, "-frames:v", "1"]).arg(&picture).status().unwrap().success());
                if !picture.exists() {
                    return u64::MAX; // Behind the film's end.
                }
                found.iter().zip(pixels("looked-at.png").iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>()
            };
            let number = (at_s.unwrap() * rate).round();
            let (own, others) = (off_from(number), [1.0, 2.0].map(|later| off_from(number + later)));
            assert!(others.iter().all(|other| own < *other), "{name}: {own} {others:?}");
        }
    }

    #[test]
    fn hdr_becomes_8_bit_and_keeps_its_colours() {
        let home = tempfile::tempdir().unwrap();
        for curve in ["arib-std-b67", "smpte2084"] {
            let to_hdr = format!(
                "scale=out_color_matrix=bt709,format=yuv444p,setparams=color_primaries=bt709:color_trc=bt709:colorspace=bt709,\
                 zscale=t=linear:npl=203,format=gbrpf32le,zscale=p=2020:t={curve}:m=2020_ncl:r=tv:npl=203,format=yuv420p10le"
            );
            let coded = [
                "-vf",
                &to_hdr,
                "-c:v",
                "libx265",
                "-x265-params",
                "log-level=error",
                "-crf",
                "10",
                "-color_trc",
                curve,
            ];
            let options = [&PICTURES[..], &coded, &["-color_primaries", "bt2020", "-colorspace", "bt2020nc"]].concat();
            let Some(film) = made(home.path(), "hdr.mp4", &options) else { return };
            assert_eq!(film.range, Range::High(curve));
            for Taken { name, at_s, .. } in taken_of(film, home.path()) {
                let n = (at_s.unwrap() * 10.0).round();
                let select = format!("select=eq(n\\,{n})");
                let mut command = FFMPEG.command();
                command.args(["-nostdin", "-v", "error", "-y"]).args(PICTURES).args(["-vf", &select, "-frames:v", "1"]);
                assert!(command.arg(home.path().join("truth.png")).status().unwrap().success());
                let pixels = |name: &str| image::open(home.path().join(name)).unwrap().into_rgb8();
                let (found, truth) = (pixels(&name), pixels("truth.png"));
                let off = found.iter().zip(truth.iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
                let off = off as f64 / truth.len() as f64;
                // What is shown without the curve is off by 70.
                assert!(off < 20.0, "{curve}: {name} is off by {off:.1}");
            }
        }
    }

    #[test]
    fn frames_of_a_film_on_its_side_are_upright() {
        let home = tempfile::tempdir().unwrap();
        let Some(_) = made(home.path(), "plain.mp4", &[&PICTURES[..], &["-pix_fmt", "yuv420p"]].concat()) else {
            return;
        };
        let plain = home.path().join("plain.mp4");
        let copied = ["-i", plain.to_str().unwrap(), "-c", "copy"];
        let tagged = made(home.path(), "turned.mp4", &[&copied[..], &["-metadata:s:v:0", "rotate=90"]].concat());
        // From version 6 on it is an option of the input.
        let is_turned = |film: &Film| film.size_px == (96, 128);
        let film = tagged.filter(is_turned);
        let film =
            film.or_else(|| made(home.path(), "turned.mp4", &[&["-display_rotation", "90"], &copied[..]].concat()));
        let taken = taken_of(film.filter(is_turned).expect("a film on its side"), home.path());
        assert!(taken.len() >= FEWEST);
        for Taken { name, .. } in taken {
            assert_eq!(image::image_dimensions(home.path().join(name)).unwrap(), (96, 128));
        }
    }
}

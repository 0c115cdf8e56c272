//! Whether a format's steps and ranges hold a scene, and in which frame they do.
//!
//! Everything here is decided by medians, so that neither strays nor up to half of the Gaussians move a frame.

use crate::spz::{MAX_COORDINATE, MAX_FRACTION_BITS, SCALE_RANGE};
use crate::{Format, Frame, Gaussians, Unreadable};

/// A Gaussian is harmed where a step is larger than this share of its middle deviation: rounding moves it by half of that at most.
const LARGEST_STEP: f64 = 0.5;
/// … or where its middle deviation is cut by more than this much of its ln.
const LARGEST_CUT: f64 = 0.1;
/// Share of harmed Gaussians from which another frame is tried.
const HARMED_SHARE: f64 = 0.01;
/// Share from which there is no use in writing the file.
const LOST_SHARE: f64 = 0.5;
/// Where the median of the middle deviations goes, units of the file, if units are changed: well within the range of .spz, whose centres
/// then reach 5,000 such deviations.
const MEDIAN_SIZE: f64 = 0.02;

/// A scene in the frame of a file.
#[derive(Debug)]
pub(crate) struct Fitted {
    pub(crate) gaussians: Gaussians,
    pub(crate) frame: Frame,
    /// Which of the scene's Gaussians each one is.
    pub(crate) sources: Vec<usize>,
    /// What was done, a sentence each.
    pub(crate) warnings: Vec<String>,
}

/// Numbers of one Gaussian in the scene's own frame.
struct Place {
    centre: [f64; 3],
    /// Its middle deviation.
    size: f64,
}

/// What a format does to a scene in some frame.
struct Harm {
    /// Gaussians that end in another place or size.
    n_harmed: usize,
    /// Coordinates beyond it are left out.
    reach: f64,
    n_beyond: usize,
}

/// Brings Gaussians into a frame in which `format` holds them: the scene's own, else moved, else in other units as well.
///
/// * `frame`: that of `gaussians`.
///
/// # Errors
/// [`Unreadable`] where no frame helps.
pub(crate) fn fitted(format: Format, gaussians: &Gaussians, frame: &Frame) -> Result<Fitted, Unreadable> {
    let n = gaussians.len();
    let as_they_are =
        |warnings| Fitted { gaussians: gaussians.clone(), frame: *frame, sources: (0..n).collect(), warnings };
    // Numbers of 32 bits lose nothing in a file of such numbers.
    if n == 0 || matches!(format, Format::Ply | Format::Glb) && frame.is_identity() {
        return Ok(as_they_are(Vec::new()));
    }
    let places: Vec<Place> = (0..n).map(|index| place(gaussians, index, frame)).collect();
    let size = median(places.iter().map(|place| place.size));
    let middle = [0, 1, 2].map(|axis: usize| median(places.iter().map(|place| place.centre[axis])));
    // Offsets of few digits: multiples of a power of ten above the Gaussians' size.
    let digit = 10f64.powf((100.0 * size).log10().ceil());
    let moved = Frame { offset: middle.map(|x| (x / digit).round() * digit + 0.0), scale: 1.0 };
    let rescaled = Frame { scale: 10f64.powf((size / MEDIAN_SIZE).log10().round()), ..moved };
    let bearable = |harm: &Harm| harm.n_harmed as f64 <= HARMED_SHARE * n as f64;
    let own = Frame::default();
    let harm_there = harm(format, &places, &own);
    let (mut chosen, mut harmed) = (own, harm(format, &places, &own));
    for candidate in [moved, rescaled] {
        if bearable(&harmed) {
            break;
        }
        let harm = harm(format, &places, &candidate);
        if harm.n_harmed < harmed.n_harmed {
            (chosen, harmed) = (candidate, harm);
        }
    }
    let name = format.extension();
    if harmed.n_harmed as f64 > LOST_SHARE * n as f64 {
        return Err(Unreadable::new(format!(
            "would show another scene: a .{name} moves, cuts or leaves out {} of its {n} Gaussians, whose median size is {size:.3e} at \
             ({:.1}, {:.1}, {:.1}); write a .ply",
            harmed.n_harmed, middle[0], middle[1], middle[2]
        )));
    }
    let mut warnings = Vec::new();
    if !chosen.is_identity() {
        warnings.push(format!(
            "its numbers are not the scene's own, as a .{name} in these would move, cut or leave out {} of {n} Gaussians: {chosen}",
            harm_there.n_harmed
        ));
    }
    if harmed.n_beyond > 0 {
        warnings.push(format!(
            "{} of {n} Gaussians lie farther out than the {:.0} units that a .{name} reaches in steps fine enough for the others: they are left \
             out",
            harmed.n_beyond, harmed.reach
        ));
    }
    let coarse = harmed.n_harmed - harmed.n_beyond;
    if coarse > 0 && !bearable(&harmed) {
        warnings.push(format!(
            "{coarse} of {n} Gaussians are smaller or larger than a .{name} can say: they are moved or cut"
        ));
    }
    let sources: Vec<usize> = (0..n).filter(|&index| within(&places[index], &chosen, harmed.reach)).collect();
    let gaussians = in_frame(&gaussians.chosen(&sources), &sources, &places, frame, &chosen);
    Ok(Fitted { gaussians, frame: chosen, sources, warnings })
}

fn place(gaussians: &Gaussians, index: usize, frame: &Frame) -> Place {
    let centre = gaussians.centres[index];
    let mut scales = gaussians.log_scales[index];
    scales.sort_unstable_by(f32::total_cmp);
    Place {
        centre: std::array::from_fn(|axis| frame.offset[axis] + frame.scale * f64::from(centre[axis])),
        size: frame.scale * f64::from(scales[1]).exp(),
    }
}

/// The middle value; of an even number the upper one.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// A coordinate in a file's frame.
fn coordinate(place: &Place, frame: &Frame, axis: usize) -> f64 {
    (place.centre[axis] - frame.offset[axis]) / frame.scale
}

fn farthest(place: &Place, frame: &Frame) -> f64 {
    (0..3).map(|axis| coordinate(place, frame, axis).abs()).fold(0.0, f64::max)
}

fn within(place: &Place, frame: &Frame, reach: f64) -> bool {
    farthest(place, frame) <= reach
}

fn harm(format: Format, places: &[Place], frame: &Frame) -> Harm {
    let count = |is_harmed: &dyn Fn(&Place) -> bool| places.iter().filter(|place| is_harmed(place)).count();
    // Readers of all formats have numbers of 32 bits.
    let of_32_bits = |place: &Place| farthest(place, frame) * f64::from(f32::EPSILON);
    let too_coarse = |place: &Place, step: f64| step.max(of_32_bits(place)) > LARGEST_STEP * place.size / frame.scale;
    match format {
        Format::Ply | Format::Glb => {
            Harm { n_harmed: count(&|place| too_coarse(place, 0.0)), reach: f64::INFINITY, n_beyond: 0 }
        }
        Format::Spz => {
            let [least, largest] = SCALE_RANGE.map(f64::from);
            let is_cut = |place: &Place| {
                let size = (place.size / frame.scale).ln();
                size < least - LARGEST_CUT || size > largest + LARGEST_CUT
            };
            let of_bits = |bits: u8| {
                let step = 0.5f64.powi(i32::from(bits));
                let reach = f64::from(MAX_COORDINATE) * step;
                let is_beyond = |place: &Place| !within(place, frame, reach);
                let is_harmed = |place: &Place| is_cut(place) || is_beyond(place) || too_coarse(place, step);
                Harm { n_harmed: count(&is_harmed), reach, n_beyond: count(&is_beyond) }
            };
            // Finer steps only where they save more than they leave out.
            let all = (0..=MAX_FRACTION_BITS).map(of_bits);
            all.min_by_key(|harm| (harm.n_harmed, harm.n_beyond, harm.reach as u64)).unwrap_or(Harm {
                n_harmed: places.len(),
                reach: f64::INFINITY,
                n_beyond: 0,
            })
        }
        Format::Sog => {
            let log = |x: f64| x.abs().ln_1p().copysign(x);
            let steps = [0, 1, 2].map(|axis: usize| {
                let range = places.iter().map(|place| log(coordinate(place, frame, axis)));
                let (least, largest) = range.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
                (largest - least) / 65_535.0
            });
            let step = |place: &Place| {
                (0..3).map(|axis| steps[axis] * (coordinate(place, frame, axis).abs() + 1.0)).fold(0.0, f64::max)
            };
            Harm { n_harmed: count(&|place| too_coarse(place, step(place))), reach: f64::INFINITY, n_beyond: 0 }
        }
    }
}

/// * `chosen`: the Gaussians of `sources`, in the frame `from`.
fn in_frame(chosen: &Gaussians, sources: &[usize], places: &[Place], from: &Frame, to: &Frame) -> Gaussians {
    if from == to {
        return chosen.clone();
    }
    let more = (from.scale / to.scale).ln();
    let centre = |&index: &usize| std::array::from_fn(|axis| coordinate(&places[index], to, axis) as f32);
    Gaussians {
        centres: sources.iter().map(centre).collect(),
        log_scales: chosen.log_scales.iter().map(|s| s.map(|s| (f64::from(s) + more) as f32)).collect(),
        ..chosen.clone()
    }
}

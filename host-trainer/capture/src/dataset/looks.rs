//! What a decoded photograph looks like: whether it says anything, and whether it shows something on nothing.

use super::Photograph;

/// A view of which less than this share counts hardly constrains anything.
pub(super) const MIN_COUNTED_SHARE: f64 = 0.1;

/// Levels by which a pixel may miss the colour it is of.
const TOLERANCE_LEVELS: u8 = 6;

/// A border is of one colour where so much of it is, and of this many of its four sides at least the other share.
///
/// A picture between two black bars has two such sides, a landscape under an even sky one. An object that the frame cuts on one side
/// leaves three.
const BARE_SHARE: f64 = 0.6;
const BARE_SIDES: usize = 3;
const BARE_SHARE_OF_SIDE: f64 = 0.4;

/// Whether a decoded view says anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    Sound,
    Flat,
    MostlyMasked,
}

impl Look {
    pub(super) fn of(photograph: &Photograph) -> Self {
        let first = &photograph.image.rgb[..3];
        let mask = photograph.mask.as_ref();
        let counted_share = mask.map_or(1.0, |mask| mask.n_valid() as f64 / mask.valid.len() as f64);
        if photograph.image.rgb.chunks_exact(3).all(|pixel| pixel == first) {
            Self::Flat
        } else if counted_share < MIN_COUNTED_SHARE {
            Self::MostlyMasked
        } else {
            Self::Sound
        }
    }
}

/// What a photograph looks like, composited on its background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Looks {
    /// Share of its pixels that are not wholly transparent.
    pub(super) shown: f64,
    /// Whether it says anything.
    pub(super) look: Look,
    /// The colour of its border, where that is one.
    pub(super) border: Option<[u8; 3]>,
    /// Whether some of its pixels do not count.
    pub(super) leaves_out: bool,
}

impl Looks {
    /// * `shown`: share of the pixels that are not wholly transparent.
    pub(super) fn of(photograph: &Photograph, shown: f64) -> Self {
        let leaves_out = photograph.mask.as_ref().is_some_and(|mask| mask.n_valid() < mask.valid.len());
        Self { shown, look: Look::of(photograph), border: border(photograph), leaves_out }
    }
}

/// Whether two colours are one but for what a JPEG leaves of an even surface.
pub(super) fn is_like(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= TOLERANCE_LEVELS)
}

/// The median of each channel.
pub(super) fn median_colour(colours: impl Iterator<Item = [u8; 3]> + Clone) -> Option<[u8; 3]> {
    let median = |channel: usize| {
        let mut levels: Vec<u8> = colours.clone().map(|colour| colour[channel]).collect();
        levels.sort_unstable();
        levels.get(levels.len() / 2).copied()
    };
    Some([median(0)?, median(1)?, median(2)?])
}

/// The colour that most pixels of the border have; pixels that do not count say nothing, and most of them must count.
fn border(photograph: &Photograph) -> Option<[u8; 3]> {
    let (image, mask) = (&photograph.image, photograph.mask.as_ref());
    let (width, height) = (image.width_px as usize, image.height_px as usize);
    let counted = |at: usize| mask.is_none_or(|mask| mask.valid[at]);
    let side = |pixels: &mut dyn Iterator<Item = usize>| -> Vec<[u8; 3]> {
        pixels.filter(|at| counted(*at)).filter_map(|at| image.rgb[3 * at..].first_chunk().copied()).collect()
    };
    let sides = [
        side(&mut (0..width)),
        side(&mut ((height - 1) * width..height * width)),
        side(&mut (0..height).map(|y| y * width)),
        side(&mut (0..height).map(|y| y * width + width - 1)),
    ];
    let n: usize = sides.iter().map(Vec::len).sum();
    let colour = median_colour(sides.iter().flatten().copied()).filter(|_| n >= width + height)?;
    let alike = sides.each_ref().map(|side| side.iter().filter(|pixel| is_like(**pixel, colour)).count());
    let bare = alike.iter().zip(&sides).filter(|(n, side)| **n as f64 >= BARE_SHARE_OF_SIDE * side.len().max(1) as f64);
    (bare.count() >= BARE_SIDES && alike.iter().sum::<usize>() as f64 >= BARE_SHARE * n as f64).then_some(colour)
}

#[cfg(test)]
mod tests {
    use super::super::{Image, Mask};
    use super::*;

    const SIZE_PX: u32 = 40;

    /// A photograph of this colour wherever `is_bare` says so, and of many elsewhere.
    fn photograph(bare: [u8; 3], is_bare: impl Fn(u32, u32) -> bool) -> Photograph {
        let pixel = |i: u32| {
            let (x, y) = (i % SIZE_PX, i / SIZE_PX);
            // A little noise, as a JPEG has it.
            let level =
                |c: usize| if is_bare(x, y) { bare[c].saturating_add((i % 3) as u8) } else { (i * 37 % 251) as u8 };
            [level(0), level(1), level(2)]
        };
        let rgb = (0..SIZE_PX * SIZE_PX).flat_map(pixel).collect();
        Photograph { image: Image { width_px: SIZE_PX, height_px: SIZE_PX, rgb }, mask: None }
    }

    #[test]
    fn a_border_of_one_colour_is_found_where_an_object_is_cut_and_not_where_bars_or_a_sky_are() {
        let white = [250, 251, 250];
        let bare = |is_bare: fn(u32, u32) -> bool| Looks::of(&photograph(white, is_bare), 1.0).border;
        let whole = bare(|x, y| x.abs_diff(20) + y.abs_diff(20) > 12).expect("a border");
        assert!(is_like(whole, white), "{whole:?}");
        assert!(bare(|x, y| y < 10 || x.abs_diff(20) > 12).is_some(), "cut by the lower side");
        assert_eq!(bare(|_, y| !(6..34).contains(&y)), None, "between two bars");
        assert_eq!(bare(|_, y| y < 20), None, "under a sky");
        assert_eq!(bare(|_, _| false), None, "a photograph");
    }

    #[test]
    fn pixels_that_do_not_count_say_nothing() {
        let mut photograph = photograph([0; 3], |x, y| x.min(y) < 3 || x.max(y) > 36);
        assert!(Looks::of(&photograph, 1.0).border.is_some());
        let valid =
            (0..SIZE_PX * SIZE_PX).map(|i| (5..35).contains(&(i % SIZE_PX)) && (5..35).contains(&(i / SIZE_PX)));
        photograph.mask = Some(Mask { width_px: SIZE_PX, height_px: SIZE_PX, valid: valid.collect() });
        assert_eq!(Looks::of(&photograph, 1.0).border, None, "the frame that undistorting leaves");
    }
}

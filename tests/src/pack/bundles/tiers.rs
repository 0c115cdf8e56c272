//! Tiers, files that end at one, and files with something behind them.

use pocketsplat_format::bundle::{Effects, cut_after};
use pocketsplat_format::{Bundle, Camera};

use super::{ANISOTROPIC, SMALL, anchors, front, in_tiers, small};
use crate::pack::sample::Sample;

/// Tiers, files that end at one, and files with something behind them.
pub(super) fn samples() -> Vec<Sample> {
    let effects = Effects { view_colour: true, background: true, ..ANISOTROPIC };
    let some = anchors(36, SMALL, effects, true, 500);
    let mut draft = small(effects, SMALL, true, 500);
    // The first and the fifth tier are empty.
    draft.tiers = in_tiers(&some, &[0, 5, 11, 17, 17, 24, 30, 36], 4);
    draft.max_chunk_anchors = 4;
    draft.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let all = draft.clone().anchors();
    let n_anchors: Vec<usize> = draft.tiers.iter().map(|tier| tier.iter().map(Vec::len).sum()).collect();
    let whole = draft.file();
    let mut samples = Vec::new();
    let mut push = |name: String, about: String, bytes: Vec<u8>, views: Vec<(u8, Camera)>| {
        let most = views.iter().map(|view| usize::from(view.0)).max().unwrap_or(0);
        let anchors = all[..n_anchors[..most].iter().sum()].to_vec();
        samples.push(Sample { name, about, bytes, anchors, views });
    };
    let about = "Eight tiers, the first and the fifth of which are empty.".to_owned();
    push("tiers-8".to_owned(), about, whole.clone(), vec![(8, front()), (3, front())]);
    for (tiers, end) in tier_ends(&whole) {
        if tiers < 8 {
            let about = format!("The same, ending where {tiers} tiers end.");
            push(format!("tiers-8-cut-{tiers}"), about, whole[..end].to_vec(), vec![(tiers, front())]);
        }
    }
    for (tiers, end) in tier_ends(&whole).into_iter().filter(|(tiers, _)| [1, 5, 7].contains(tiers)) {
        let mut written = whole.clone();
        assert_eq!(cut_after(&mut written, tiers), Ok(end), "a sound draft");
        let about = format!(
            "The same, cut by who wrote its length anew after {tiers} tiers; what was behind them lies in the partition still."
        );
        push(format!("tiers-8-cut-{tiers}-in-partition"), about, written, vec![(tiers, front())]);
    }
    let erased = [whole.clone(), vec![0xFF; 96]].concat();
    let about = "The same in a longer flash partition: bytes of someone else follow.".to_owned();
    push("tiers-8-in-partition".to_owned(), about, erased, vec![(8, front())]);
    samples
}

/// Tiers and length of each file that a bundle can be cut to; of tiers that end alike the last.
fn tier_ends(file: &[u8]) -> Vec<(u8, usize)> {
    let bundle = Bundle::parse(file).expect("a sound draft");
    let mut ends: Vec<(u8, usize)> = (1..).zip(crate::bundles::tier_ends(&bundle)).collect();
    ends.reverse();
    ends.dedup_by_key(|(_, end)| *end);
    ends.reverse();
    ends
}

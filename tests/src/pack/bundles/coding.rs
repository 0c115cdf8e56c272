//! Tables, coded heads, widths.

use pocketsplat_format::bundle::{Effects, MAX_FEATURE_DIM, MAX_OFFSETS};

use super::{SMALL, anchors, front, one_chunk, sample, small, view};
use crate::pack::draft::{CoderDraft, Draft, HeadCoding, n_channels};
use crate::pack::heads::{UNIT, Widths};
use crate::pack::models::TableDraft;
use crate::pack::numbers::Numbers;
use crate::pack::sample::{NO_EFFECT, Sample};

/// Section 6, the coded heads of section 3, and widths.
pub(super) fn samples() -> Vec<Sample> {
    let mut samples = Vec::new();
    let draft = small(NO_EFFECT, SMALL, false, 300);
    let table = |min_symbol: i16, bounds: &[u16], origin: f32, step: f32| TableDraft {
        origin,
        step,
        min_symbol,
        bounds: bounds.to_vec(),
    };
    let mut corners = draft.clone();
    let tables = vec![
        // Only the escape.
        table(0, &[0, 4096], 0.0, 1.0 / 32.0),
        // The lowest symbols, and entries without slots before, between and behind others.
        table(i16::MIN, &[0, 0, 100, 100, 4000, 4000, 4096], 512.0, 1.0 / 64.0),
        // The highest.
        table(i16::MAX - 3, &[0, 1, 2, 4000, 4095, 4096], -1023.0, 1.0 / 32.0),
        // An origin, and more slots for the escape than for any symbol.
        table(-20, &[0, 64, 128, 192, 256, 320, 384, 448, 512, 4096], -0.125, 1.0 / 8.0),
        // One symbol with all slots but one.
        table(-1, &[0, 4095, 4096], 0.0, 1.0 / 16.0),
    ];
    corners.coder = CoderDraft::Tables(tables, vec![0, 1, 2, 4, 3, 3, 3, 3, 4, 0, 4, 4, 4, 0]);
    for (anchor, at) in corners.tiers[0][0].iter_mut().zip(0_i16..) {
        let symbols = &mut anchor.symbols;
        symbols[0] = [0, 5, -9, i16::MAX / 512, -40][at as usize % 5];
        symbols[1] = i16::MIN + [1, 3, 0, 2, 400][at as usize % 5];
        symbols[2] = i16::MAX - at % 5;
        symbols[4..8].iter_mut().zip(0..).for_each(|(symbol, i)| *symbol = -20 + (at + 2 * i) % 11);
        [symbols[3], symbols[8], symbols[10]] = [-1, -1 - at % 2, 3 * (at % 3 - 1)];
    }
    // Of a symbol that has an entry.
    corners.recode = Some(|anchor, channel, usual| match (anchor % 4, channel, usual.as_slice()) {
        (1, 4, &[(start, _)]) => {
            vec![(512, 4096 - 512), crate::pack::stream::raw(0xFF), crate::pack::stream::raw((start / 64) as u8 + 0xEC)]
        }
        _ => usual,
    });
    let about = "Tables at their limits: only an escape, the lowest and the highest symbols, entries without slots, origins, an escape \
                 with most slots, and escapes of symbols that have an entry.";
    samples.push(sample("tables-limits", about, corners, &[front()]));

    let mut bits = draft.clone();
    for (anchor, at) in bits.tiers[0][0].iter_mut().zip(0..) {
        anchor.symbols.iter_mut().enumerate().for_each(|(c, symbol)| *symbol = -(((at + c) % 3 == 0) as i16));
    }
    bits.tiers[0][0].truncate(6);
    bits.count_tables([0.5, 2.0, 0.75]);
    samples.push(sample("symbols-of-1-bit", "Symbols of one bit: −1 and 0.", bits, &[front()]));

    let mut largest = draft.clone();
    largest.symbol_bits = Some([16; 3]);
    samples.push(sample(
        "symbols-of-16-bits",
        "Header bits of symbols that are larger than needed.",
        largest,
        &[front()],
    ));

    let widest = Widths {
        features: MAX_FEATURE_DIM.into(),
        offsets: MAX_OFFSETS.into(),
        colour_hidden: MAX_FEATURE_DIM.into(),
        detail_hidden: MAX_FEATURE_DIM.into(),
    };
    let effects = Effects { detail: true, anisotropic: true, background: true, ..NO_EFFECT };
    let mut wide = Draft::of(effects, widest, one_chunk(anchors(3, widest, effects, true, 301)), front(), 301);
    wide.masks = true;
    // Nearly all weights are 0, so that they take few bytes.
    let mut numbers = Numbers::of(302);
    for head in &mut wide.heads {
        for weights in [&mut head.w1, &mut head.w2] {
            let n = weights.len() as i32;
            weights.fill(0);
            for _ in 0..48 {
                weights[numbers.between(0, n - 1) as usize] = numbers.between(-90, 90) as i16;
            }
        }
    }
    wide.head_coding = HeadCoding::Counted;
    // A table a channel, and two that none uses.
    let one_each = (0..n_channels(widest, effects) as u16).collect();
    let CoderDraft::Tables(of_groups, groups) = &wide.coder else { unreachable!("drafts begin with tables") };
    let mut tables: Vec<TableDraft> = groups
        .iter()
        .enumerate()
        .map(|(channel, &group)| {
            let found = wide.tiers.iter().flatten().flatten().map(|anchor| anchor.symbols[channel]);
            let [least, most] = [found.clone().min(), found.clone().max()].map(|end| end.expect("anchors"));
            TableDraft::counting(of_groups[usize::from(group)].step, [least, most], found)
        })
        .collect();
    tables.extend([tables[0].clone(), tables[1].clone()]);
    wide.coder = CoderDraft::Tables(tables, one_each);
    let about = "The widest anchors, F = 256 and K = 32, the widest heads, and 360 tables.";
    samples.push(sample("widest", about, wide, &[front()]));

    let least = Widths { features: 1, offsets: 1, colour_hidden: 1, detail_hidden: 1 };
    let effects = Effects { detail: true, ..NO_EFFECT };
    let mut smallest = Draft::of(
        effects,
        least,
        one_chunk(anchors(1, least, effects, false, 303)),
        view([1.7, -1.1, 0.6], [1, 1]),
        303,
    );
    for head in &mut smallest.heads {
        head.w1.fill(40);
        head.w2.fill(70);
        head.b1.fill(9);
        head.b2.fill(30);
    }
    smallest.heads[1].b2.fill(-40);
    let certain =
        |symbol: i16, step: f32| TableDraft { origin: 0.0, step, min_symbol: symbol, bounds: vec![0, 4095, 4096] };
    smallest.head_coding = HeadCoding::Tables([certain(40, UNIT), certain(70, UNIT)]);
    smallest.tiers[0][0][0].symbols = vec![6; smallest.n_channels()];
    smallest.coder = CoderDraft::Tables(vec![certain(6, 1.0 / 128.0)], vec![0; smallest.n_channels()]);
    let about = "The smallest: widths of 1, one anchor in a lattice of one cell, a preview of one pixel, one table; the symbols of heads and \
                 chunk are certain, so that their streams have no words.";
    samples.push(sample("smallest", about, smallest, &[view([1.7, -1.1, 0.6], [1, 1]), front()]));
    samples
}

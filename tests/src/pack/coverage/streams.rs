//! What the streams of the chunks say, read symbol by symbol.

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::{Chunk, Coder};
use pocketsplat_format::context::{Context, Trail};
use pocketsplat_format::entropy::{AnsReader, SymbolModel, UniformByte};

use super::Found;
use crate::bundles::chunks_offset;
use crate::pack::expected::decoded;
use crate::pack::models::{Anchor, CodedAnchor, walk};

pub(super) const ENDS: &[(&str, &[i64])] = &[
    ("symbol", &[-32768, 32767]),
    ("exponent of features", &[-24, 7]),
    ("exponent of offsets", &[-24, 7]),
    ("table index", &[0, 63]),
    ("byte behind an escape", &[0, 1, 252, 253, 254, 255]),
    ("part of a mean", &[-4, -3, -2, -1, 0, 1, 2, 3]),
    ("hidden unit", &[0, 32767]),
    ("output", &[-32768, 32767]),
    ("unit coordinate", &[0, 65535]),
    ("level of an anchor", &[0, 1, 2]),
    ("drawn before an offset", &[0, 1, 2, 3]),
];

pub(super) const OTHERS: &[&str] = &[
    "a chunk without words",
    "an escape of a table",
    "an escape of a symbol that has an entry",
    "no escape",
    "a near escape below a mean's nearest symbol",
    "a near escape above a mean's nearest symbol",
    "a near escape of a mirrored table, above",
    "a near escape of a mirrored table, below",
    "an index of a table below 0",
    "an index of a table above 63",
    "an exponent below −24",
    "an exponent above 7",
    "a cell below the frame",
    "a cell beyond the frame",
    "a place cut to 16 bits",
    "a parent's value beyond its limit",
    "a residual beyond its limit",
    "an anchor with all offsets drawn, others not",
    "an anchor without a drawn offset",
    "two anchors in one cell",
    "a full trie",
    "levels that begin anew in a chunk",
];

pub(super) fn mark(found: &mut Found, bundle: &Bundle<'_>, file: &[u8]) {
    let chunks = decoded(bundle).expect("sound chunks");
    let (n_offsets, has_masks) = (u32::from(bundle.header().n_offsets), bundle.masks().is_some());
    let mut numbers: Vec<(&str, i64)> = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for anchors in &chunks {
        for anchor in anchors {
            numbers.extend(anchor.symbols.iter().map(|&symbol| ("symbol", i64::from(symbol))));
            let n_drawn = anchor.drawn.count_ones();
            found.mark(has_masks && n_drawn == n_offsets, "an anchor with all offsets drawn, others not");
            found.mark(has_masks && n_drawn == 0, "an anchor without a drawn offset");
            let before = |k: u32| i64::from((anchor.drawn & ((1_u64 << k) - 1) as u32).count_ones()).min(3);
            numbers.extend((0..n_offsets).filter(|_| has_masks).map(|k| ("drawn before an offset", before(k))));
            found.mark(!seen.insert(anchor.cell), "two anchors in one cell");
        }
        found.mark(anchors.len() == 1024 && is_solid(anchors), "a full trie");
    }
    found.mark(bundle.chunks().any(|chunk| chunk.n_anchors() > 0 && chunk.n_bytes() == 0), "a chunk without words");
    match bundle.coder() {
        Coder::Static(_) => mark_tables(found, bundle, file),
        Coder::Context(context) => {
            for (chunk, anchors) in bundle.chunks().zip(&chunks) {
                mark_context(found, &mut numbers, bundle, context, (words_of(bundle, &chunk, file), anchors));
            }
        }
    }
    for (name, number) in numbers {
        let ends = ENDS.iter().find(|of| of.0 == name).map_or(&[][..], |of| of.1);
        found.mark_ends(name, number, ends);
    }
}

fn words_of<'a>(bundle: &Bundle<'_>, chunk: &Chunk<'_>, file: &'a [u8]) -> &'a [[u8; 2]] {
    let start = chunks_offset(bundle) + chunk.offset() as usize;
    file[start..start + chunk.n_bytes()].as_chunks().0
}

/// Whether cells fill a box.
fn is_solid(anchors: &[Anchor]) -> bool {
    let span = |axis: usize| {
        let along = anchors.iter().map(|anchor| anchor.cell[axis]);
        along.clone().max().zip(along.min()).map_or(0, |(most, least)| most.abs_diff(least) as usize + 1)
    };
    span(0) * span(1) * span(2) == anchors.len()
}

/// Whether a channel of an anchor is coded.
fn is_coded(bundle: &Bundle<'_>, channel: usize, drawn: u32) -> bool {
    channel.checked_sub(bundle.header().n_scalars()).is_none_or(|coordinate| drawn >> (coordinate / 3) & 1 == 1)
}

fn mark_tables(found: &mut Found, bundle: &Bundle<'_>, file: &[u8]) {
    let Some(tables) = bundle.tables() else { return };
    let mut n_escapes = 0;
    for chunk in bundle.chunks() {
        let (mut symbols, mut codes) = (AnsReader::new(words_of(bundle, &chunk, file)), bundle.lattice().trie.codes());
        for _ in 0..chunk.n_anchors() {
            codes.next(&mut symbols);
            let drawn = bundle.masks().map_or(u32::MAX, |masks| masks.mask(&mut symbols));
            for channel in (0..tables.n_channels()).filter(|&channel| is_coded(bundle, channel, drawn)) {
                let table = tables.table_of(channel).and_then(|table| tables.get(table)).expect("a table");
                if symbols.symbol(&table).is_some() {
                    continue;
                }
                n_escapes += 1;
                let bytes = [symbols.symbol(&UniformByte), symbols.symbol(&UniformByte)];
                let symbol = i16::from_be_bytes(bytes);
                let has_entry = (0..4096).any(|quantile| table.slot(quantile).symbol == Some(symbol));
                found.mark(has_entry, "an escape of a symbol that has an entry");
            }
        }
        symbols.finish().expect("a sound chunk");
    }
    found.mark(n_escapes > 0, "an escape of a table");
    found.mark(n_escapes == 0 && bundle.n_anchors() > 0, "no escape");
}

/// The values of `round(4096·2^(−i/8))`.
const PARTS: [i64; 8] = [4096, 3756, 3444, 3158, 2896, 2656, 2435, 2233];

fn mark_context(
    found: &mut Found,
    numbers: &mut Vec<(&str, i64)>,
    bundle: &Bundle<'_>,
    context: &Context<'_>,
    (words, anchors): (&[[u8; 2]], &[Anchor]),
) {
    let coded = walk(context, anchors, |channel, drawn| is_coded(bundle, channel, drawn));
    let n_channels = bundle.header().n_channels();
    let mut trail = Trail::default();
    let mut n_coarsest = 0;
    for (anchor, coded) in anchors.iter().zip(&coded) {
        let [features, _, offsets] = coded.exponents.map(i64::from);
        numbers.extend([("exponent of features", features), ("exponent of offsets", offsets)]);
        numbers.extend(coded.hidden.iter().map(|&unit| ("hidden unit", i64::from(unit))));
        let network = context.network(coded.level);
        let outputs: Vec<i64> = (0..context.n_outputs()).map(|row| network.output(row, &coded.hidden).into()).collect();
        numbers.extend(outputs.iter().map(|&output| ("output", output)));
        found.mark(outputs[2 * n_channels..].iter().any(|&q| q < -24), "an exponent below −24");
        found.mark(outputs[2 * n_channels..].iter().any(|&q| q > 7), "an exponent above 7");
        match context.place(&mut trail, anchor.cell) {
            Some(place) => {
                numbers.push(("level of an anchor", place.level as i64));
                n_coarsest += usize::from(place.level == 2);
                mark_place(found, context, anchor, place.level, place.position);
                let n_given = context.n_parent_inputs();
                let at_limit = coded.inputs.iter().skip(3).take(n_given).any(|&given| given.unsigned_abs() == 1 << 14);
                found.mark(place.level < 2 && at_limit, "a parent's value beyond its limit");
            }
            None => {
                let frame = context.frame();
                numbers.extend(frame.unit(anchor.cell).map(|unit| ("unit coordinate", i64::from(unit))));
                for (axis, &cell) in anchor.cell.iter().enumerate() {
                    let above = i128::from(cell) - i128::from(frame.min[axis]);
                    found.mark(above < 0, "a cell below the frame");
                    found.mark((above * i128::from(frame.scale[axis])) >> 16 > 65535, "a cell beyond the frame");
                }
            }
        }
        for channel in &coded.channels {
            let group = context.group(channel.channel) as usize;
            let q = i64::from(coded.exponents[group]);
            let index = outputs[n_channels + channel.channel] - q + 32;
            numbers.push(("table index", index.clamp(0, 63)));
            found.mark(index < 0, "an index of a table below 0");
            found.mark(index > 63, "an index of a table above 63");
            let multiplier = PARTS[(q & 7) as usize] << -(q >> 3).min(0);
            let own8 = (outputs[channel.channel] * multiplier + (1 << 14)) >> 15;
            let residual = 8 * i64::from(channel.symbol) - own8;
            found.mark(context.n_taps() > 0 && group == 0 && residual.abs() > 32768, "a residual beyond its limit");
            // With taps a feature's mean is another.
            if context.n_taps() == 0 || group > 0 {
                let part = own8 - 8 * ((own8 + 4) >> 3);
                numbers.push(("part of a mean", part));
                if channel.slots.len() == 2 {
                    let is_above = i64::from(channel.symbol) > (own8 + 4) >> 3;
                    found.mark(part >= 0 && is_above, "a near escape above a mean's nearest symbol");
                    found.mark(part >= 0 && !is_above, "a near escape below a mean's nearest symbol");
                    found.mark(part < 0 && is_above, "a near escape of a mirrored table, above");
                    found.mark(part < 0 && !is_above, "a near escape of a mirrored table, below");
                }
            }
        }
    }
    found.mark(n_coarsest > 1, "levels that begin anew in a chunk");
    mark_escapes(numbers, bundle, words, anchors, &coded);
}

/// Whether a place that an anchor has lost bits above the 16th.
fn mark_place(found: &mut Found, context: &Context<'_>, anchor: &Anchor, level: usize, position: [i16; 3]) {
    let Some([_, _, e3]) = context.level_shifts() else { return };
    if level < 2 {
        return;
    }
    for (axis, &place) in position.iter().enumerate() {
        let far = i64::from(anchor.cell[axis]) - i64::from(context.frame().min[axis]);
        let whole = (far >> e3.saturating_sub(14)) << 14_u8.saturating_sub(e3);
        found.mark(whole != i64::from(place), "a place cut to 16 bits");
    }
}

/// The bytes that follow escapes, as the stream has them: a writer may choose.
fn mark_escapes(
    numbers: &mut Vec<(&str, i64)>,
    bundle: &Bundle<'_>,
    words: &[[u8; 2]],
    anchors: &[Anchor],
    coded: &[CodedAnchor],
) {
    let (mut symbols, mut codes) = (AnsReader::new(words), bundle.lattice().trie.codes());
    for (anchor, coded) in anchors.iter().zip(coded) {
        codes.next(&mut symbols);
        let drawn = bundle.masks().map_or(anchor.drawn, |masks| masks.mask(&mut symbols));
        assert_eq!(drawn, anchor.drawn, "the anchor's own mask");
        for channel in &coded.channels {
            if symbols.symbol(&channel.model).is_none() {
                let byte = symbols.symbol(&UniformByte);
                numbers.push(("byte behind an escape", byte.into()));
                if byte >= 254 {
                    let symbol = i16::from_be_bytes([symbols.symbol(&UniformByte), symbols.symbol(&UniformByte)]);
                    assert_eq!(symbol, channel.symbol, "the symbol itself");
                }
            }
        }
    }
    symbols.finish().expect("a sound chunk");
}

//! Bundles made byte by byte from `FORMAT.md`, without the writer.

use std::vec;
use std::vec::Vec;

// By the names of whoever has this file as a module: the conformance crate draws these bundles.
use super::format::bundle::{MAGIC, crc32};
use super::format::context::{Context, Group, Network, Trail, first_tap};
use super::format::entropy::{Children, MaskModel, Slot, SymbolModel, TrieModel};
use super::testing::{AnsWriter, slot_of};

pub(super) const F: usize = 4;
pub(super) const K: usize = 3;
pub(super) const C: usize = F + 6 + 3 * K;
const N_HIDDEN: usize = 3;
/// Hidden units of the detail head.
pub(super) const DETAIL_HIDDEN: u16 = 5;
/// Bits of the lattice along an axis.
const B: usize = 3;
pub(super) const LATTICE_MIN: [i32; 3] = [-4, 10, -2];
/// Origin and step of channel c in the static tables.
pub(super) const ORIGIN: f32 = -1.0;
pub(super) const STEP: f32 = 0.25;

/// What varies between test bundles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variant {
    pub(super) masks: bool,
    pub(super) context: bool,
    /// Taps of the context.
    pub(super) n_taps: u8,
    /// The context is that of anchors that follow anchors.
    pub(super) levels: bool,
    pub(super) coded_heads: bool,
    pub(super) detail: bool,
    /// A section of an unknown kind before the manifest.
    pub(super) unknown_section: bool,
}

/// Every variant.
pub(super) fn variants() -> impl Iterator<Item = Variant> {
    (0..3 << 5).map(|bits| {
        let [masks, context, coded_heads, unknown_section, detail] = [1, 2, 4, 8, 16].map(|bit| bits & bit != 0);
        let (n_taps, levels) = (2 * u8::from(bits >> 5 == 1), bits >> 5 == 2);
        Variant { masks, context, n_taps, levels, coded_heads, unknown_section, detail }
    })
}

/// One anchor: its code in the trie, its mask, its symbols.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Anchor {
    pub(super) code: u64,
    pub(super) mask: u32,
    pub(super) symbols: [i16; C],
}

/// The anchors of each chunk of each tier; symbols of undrawn offsets are 0.
pub(super) fn tiers(variant: Variant) -> Vec<Vec<Vec<Anchor>>> {
    let mut state = 7_u32;
    let mut random = move |n: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % n
    };
    let mut chunk = |n_anchors: u64| -> Vec<Anchor> {
        (0..n_anchors)
            .map(|i| {
                let mask = if variant.masks { 1 + random((1 << K) - 1) } else { (1 << K) - 1 };
                let mut symbols = [0; C];
                for (channel, symbol) in symbols.iter_mut().enumerate() {
                    if channel < F + 6 || mask >> ((channel - F - 6) / 3) & 1 == 1 {
                        // Now and then one that needs an escape.
                        *symbol = if random(20) == 0 { random(60_000) as i16 } else { random(5) as i16 - 2 };
                    }
                }
                Anchor { code: i * 512 / n_anchors + u64::from(random(512 / n_anchors as u32)), mask, symbols }
            })
            .collect()
    };
    vec![vec![chunk(3), chunk(1)], vec![chunk(5)], vec![chunk(2), chunk(4)]]
}

fn u16s(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn u32s(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn f32s(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// (inputs, outputs) of the layers, W1 and W2 of each head; all of them see the direction of view.
fn layers(variant: Variant) -> Vec<(usize, usize)> {
    let (n_in, detail) = (F + 3, DETAIL_HIDDEN.into());
    let mut layers = vec![(n_in, F), (F, K), (n_in, F), (F, 7 * K), (n_in, F), (F, 3 * K)];
    if variant.detail {
        layers.extend([(F + 3, detail), (detail, 3)]);
    }
    layers
}

/// Weights that both storages hold exactly: multiples of 1/8.
pub(super) fn weight(layer: usize, index: usize) -> f32 {
    ((layer * 5 + index * 3) % 13) as f32 / 8.0 - 0.75
}

fn bias(layer: usize, index: usize) -> f32 {
    0.25 * (1.0 + (layer + index) as f32)
}

fn halves(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(|x| half::f16::from_f32(x).to_le_bytes()).collect()
}

/// A table of 5 symbols from −2 on.
fn table(origin: f32, step: f32) -> Vec<u8> {
    [f32s(&[origin, step]), (-2_i16).to_le_bytes().into(), u16s(&[5, 0, 400, 1500, 2600, 3600, 4000, 4096])].concat()
}

struct StaticModel;

impl SymbolModel for StaticModel {
    type Symbol = Option<i16>;

    fn slot(&self, quantile: u16) -> Slot<Option<i16>> {
        let ends = [0, 400, 1500, 2600, 3600, 4000, 4096];
        let entry = (0..6).find(|&i| quantile < ends[i + 1]).expect("below 4096");
        let symbol = (entry < 5).then_some(entry as i16 - 2);
        Slot { symbol, start: ends[entry], frequency: ends[entry + 1] - ends[entry] }
    }
}

fn push_static(slots: &mut Vec<Slot<()>>, symbol: i16) {
    let known = (-2..=2).contains(&symbol);
    slots.push(slot_of(&StaticModel, |found| found == known.then_some(symbol)));
    if !known {
        slots.extend(symbol.to_be_bytes().map(|byte| Slot { symbol: (), start: u16::from(byte) << 4, frequency: 16 }));
    }
}

fn heads(variant: Variant) -> Vec<u8> {
    let n_weights = |(n_in, n_out): (usize, usize)| n_in * n_out;
    let mut bytes = Vec::new();
    if !variant.coded_heads {
        for (layer, size) in layers(variant).into_iter().enumerate() {
            bytes.extend(halves((0..n_weights(size)).map(|i| weight(layer, i))));
            bytes.extend(halves((0..size.1).map(|i| bias(layer, i))));
        }
        return bytes;
    }
    bytes.extend(table(0.0, 0.125));
    bytes.extend(table(0.0, 0.125));
    for (layer, (_, n_out)) in layers(variant).into_iter().enumerate() {
        bytes.extend(halves((0..n_out).map(|i| bias(layer, i))));
    }
    let mut slots = Vec::new();
    for (layer, size) in layers(variant).into_iter().enumerate() {
        for i in 0..n_weights(size) {
            push_static(&mut slots, (weight(layer, i) * 8.0) as i16);
        }
    }
    bytes.extend(AnsWriter::words(&slots).as_flattened());
    bytes
}

fn trie_nodes() -> Vec<[[[u8; 2]; 2]; 3]> {
    let node =
        |level: usize, context: usize| [800 + 100 * level as u16 + 300 * context as u16, 2900].map(u16::to_le_bytes);
    (0..3 * B).map(|level| std::array::from_fn(|context| node(level, context))).collect()
}

fn mask_frequencies() -> [[[u8; 2]; 4]; K] {
    std::array::from_fn(|k| std::array::from_fn(|n| (1000 + 500 * k as u16 + 300 * n as u16).to_le_bytes()))
}

pub(super) fn context_section(variant: Variant) -> Vec<u8> {
    let n_out = 2 * C + 3;
    let level = |kind: u8, resolution: u16, n_rows: u32| [vec![kind, 0], u16s(&[resolution]), u32s(&[n_rows])].concat();
    let head = |n_levels: u8, n_taps: u8| {
        [
            LATTICE_MIN.iter().flat_map(|x| x.to_le_bytes()).collect(),
            u32s(&[0xFFFF_0000 / 7; 3]),
            f32s(&[1.0, 0.125, 0.25]),
            vec![n_levels, n_taps],
            u16s(&[N_HIDDEN as u16]),
        ]
        .concat()
    };
    let network = |n_in: usize| {
        [
            vec![9; N_HIDDEN],
            (0..n_out).map(|i| if i < 2 * C { 9 } else { 12 }).collect(),
            (0..N_HIDDEN).flat_map(|i| (1000 * i as i32).to_le_bytes()).collect(),
            (0..n_out).flat_map(|i| (100 * i as i32 - 2000).to_le_bytes()).collect(),
            (0..n_in * N_HIDDEN).map(|i| (i * 37 + 11) as u8).collect::<Vec<u8>>(),
            (0..N_HIDDEN * n_out).map(|i| ((i + 13 * (n_in % 2)) * 29 + 5) as u8 >> 3).collect(),
        ]
        .concat()
    };
    if variant.levels {
        return [head(0, 0), vec![1, 2, 3, 0], network(3), network(3 + F + 6), network(3 + F + 6)].concat();
    }
    [
        head(2, variant.n_taps),
        level(0, 3, 27),
        level(2, 9, 16),
        network(8),
        (0..first_tap(F, variant.n_taps.into())).map(|i| (i * 59 + 40) as u8).collect(),
        (0..22).map(|i| (i * 101 + 3) as u8).collect(),
    ]
    .concat()
}

/// The network and the hidden units of an anchor of a chunk, from the anchors before it.
pub(super) fn hidden<'c, 'a>(
    context: &'c Context<'a>,
    anchors: &[Anchor],
    index: usize,
) -> (Network<'c, 'a>, Vec<i16>) {
    let (mut inputs, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
    let Some(shifts) = context.level_shifts() else {
        context.features(cell(anchors[index].code), &mut inputs);
        let network = context.network(0);
        network.hidden(&inputs, &mut hidden);
        return (network, hidden);
    };
    let (mut trail, mut network) = (Trail::default(), context.network(0));
    // What the anchors that began the current cells of levels 1 and 2 give.
    let mut given = [vec![], vec![]];
    for anchor in &anchors[..=index] {
        let place = trail.next(shifts, &context.frame(), cell(anchor.code));
        network = context.network(place.level);
        context.follow(&place, &given[place.level.min(1)], &mut inputs);
        network.hidden(&inputs, &mut hidden);
        let steps = network.steps(&hidden);
        let row = anchor.symbols[..F + 6].iter().enumerate().map(|(channel, &symbol)| {
            let group = if channel < F { Group::Feature } else { Group::LogScale };
            steps.of(group).parent_input(group, symbol.into())
        });
        let row: Vec<i16> = row.collect();
        given[..place.level].fill(row);
    }
    (network, hidden)
}

/// The lattice coordinates of a code.
pub(super) fn cell(code: u64) -> [i32; 3] {
    std::array::from_fn(|axis| {
        LATTICE_MIN[axis] + (0..B).map(|bit| ((code >> (3 * bit + axis) & 1) as i32) << bit).sum::<i32>()
    })
}

/// The words of one chunk, from the definition of the trie: by recursion over the set of codes.
fn chunk_words(anchors: &[Anchor], variant: Variant) -> Vec<u8> {
    let nodes = trie_nodes();
    let trie = TrieModel::new(&nodes);
    let frequencies = mask_frequencies();
    let masks = MaskModel::new(&frequencies);
    let section = context_section(variant);
    let context = Context::parse(&section, F, 6, C).expect("a sound context");
    let mut slots = Vec::new();
    for (index, anchor) in anchors.iter().enumerate() {
        // The levels that this anchor's path shares with the one before are coded already.
        let shared = match index.checked_sub(1) {
            Some(before) => 3 * B - (64 - (anchors[before].code ^ anchor.code).leading_zeros()) as usize + 1,
            None => 0,
        };
        let children_at = |level: usize| {
            let above = 3 * B - level;
            let same_path = |other: &&Anchor| other.code >> above == anchor.code >> above;
            let bits: Vec<u64> = anchors.iter().filter(same_path).map(|other| other.code >> (above - 1) & 1).collect();
            match (bits.contains(&0), bits.contains(&1)) {
                (true, true) => Children::Both,
                (true, false) => Children::Zero,
                _ => Children::One,
            }
        };
        for level in shared..3 * B {
            let n_both = (level.saturating_sub(3)..level).filter(|&l| children_at(l) == Children::Both).count();
            let node = trie.node(level, n_both.min(2)).expect("a node");
            let children = children_at(level);
            slots.push(slot_of(&node, |found| found == children));
        }
        if variant.masks {
            for k in 0..K {
                let n_drawn = (anchor.mask & ((1 << k) - 1)).count_ones() as usize;
                let frequency = masks.frequency(k, n_drawn).expect("an offset");
                let drawn = anchor.mask >> k & 1 == 1;
                slots.push(if drawn {
                    Slot { symbol: (), start: 0, frequency }
                } else {
                    Slot { symbol: (), start: frequency, frequency: 4096 - frequency }
                });
            }
        }
        let (network, hidden) = hidden(&context, anchors, index);
        let steps = network.steps(&hidden);
        let mut residuals = Vec::new();
        for (channel, &symbol) in anchor.symbols.iter().enumerate() {
            if channel >= F + 6 && anchor.mask >> ((channel - F - 6) / 3) & 1 == 0 {
                continue;
            }
            if variant.context {
                let slots_of_symbol = network.model(channel, &steps, &hidden, &residuals).slots(symbol);
                if channel < F {
                    residuals.push(network.residual(channel, &steps, &hidden, symbol));
                }
                let slot = |&(start, frequency)| Slot { symbol: (), start, frequency };
                slots.extend(slots_of_symbol.as_slice().iter().map(slot));
            } else {
                push_static(&mut slots, symbol);
            }
        }
    }
    AnsWriter::words(&slots).into_flattened()
}

/// The whole file.
pub(super) fn bundle(variant: Variant) -> Vec<u8> {
    let tiers = tiers(variant);
    let lattice = [
        LATTICE_MIN.iter().flat_map(|x| x.to_le_bytes()).collect(),
        vec![B as u8, 0, 0, 0],
        trie_nodes().into_flattened().into_flattened().into_flattened(),
    ]
    .concat();
    let tables = [u16s(&[1, C as u16]), u16s(&[0; C]), u32s(&[8 + 2 * C as u32]), table(ORIGIN, STEP)].concat();
    let mut tier_records = Vec::new();
    let mut chunk_records = Vec::new();
    let mut chunks = Vec::new();
    let (mut n_chunks, mut n_anchors) = (0, 0);
    for tier in &tiers {
        for anchors in tier {
            let words = chunk_words(anchors, variant);
            chunk_records.extend(u32s(&[words.len() as u32, crc32(&words)]));
            chunk_records.extend(u16s(&[anchors.len() as u16, 0, 0, 0, 0, 100, 100, 100]));
            chunks.extend(words);
            pad(&mut chunks);
            n_chunks += 1;
            n_anchors += anchors.len() as u32;
        }
        tier_records.extend(u32s(&[n_chunks, n_anchors, chunks.len() as u32]));
    }
    // Escaped symbols put offsets anywhere.
    let ink_frame = f32s(&[-1e30, -1e30, -1e30, 2e28, 2e28, 2e28]);
    let directory = [tier_records, ink_frame, chunk_records].concat();
    let manifest: Vec<u8> = (0..3)
        .flat_map(|tier| {
            let psnr = if tier == 0 { f32::from_bits(0x7FC0_0000) } else { 30.0 + tier as f32 };
            [
                f32s(&[psnr]),
                u16s(&[4, 9]),
                u32s(&std::array::from_fn::<u32, 13, _>(|i| 100 * tier + i as u32)),
                vec![tier as u8, 0, 0, 0],
            ]
            .concat()
        })
        .collect();

    let mut sections = vec![(1, heads(variant)), (2, lattice)];
    if variant.masks {
        sections.push((3, mask_frequencies().concat().into_flattened()));
    }
    sections.push(if variant.context { (5, context_section(variant)) } else { (4, tables) });
    if variant.unknown_section {
        sections.push((200, b"from the future".to_vec()));
    }
    sections.extend([(6, manifest), (7, directory), (8, chunks)]);
    let n_sections = sections.len();
    let header_len = 164 + 16 * n_sections;
    let file_len = header_len + sections.iter().map(|(_, bytes)| bytes.len().next_multiple_of(4)).sum::<usize>();
    let features = 1
        | u32::from(variant.masks) << 3
        | u32::from(variant.context) << 4
        | u32::from(variant.coded_heads) << 5
        | u32::from(variant.detail) << 6
        | 1 << 7
        | 1 << 8
        | 1 << 10;
    let camera = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 6.0, 30.0, 30.0, 16.0, 12.0];
    let mut file = [
        MAGIC.to_vec(),
        u16s(&[4, header_len as u16]),
        u32s(&[file_len as u32, features, 0xFFFF_FFFF]),
        u16s(&[F as u16, K as u16]),
        u32s(&[n_anchors, n_chunks]),
        u16s(&[5]),
        vec![0, n_sections as u8],
        u16s(&[32, 24]),
        vec![10, 20, 30, tiers.len() as u8],
        f32s(&[0.125]),
        u16s(&[F as u16, if variant.detail { DETAIL_HIDDEN } else { 0 }]),
        [0.0_f64, 0.0, 0.0, 1.0].iter().flat_map(|x| x.to_le_bytes()).collect(),
        f32s(&camera),
        u16s(&[32, 24]),
        vec![16, 16, 16, 0],
    ]
    .concat();
    let mut offset = header_len;
    for (kind, bytes) in &sections {
        let crc = if *kind == 8 { 0 } else { crc32(bytes) };
        file.extend([*kind, 0, 0, 0]);
        file.extend(u32s(&[offset as u32, bytes.len() as u32, crc]));
        offset += bytes.len().next_multiple_of(4);
    }
    file.extend(crc32(&file).to_le_bytes());
    for (_, bytes) in sections {
        file.extend(bytes);
        pad(&mut file);
    }
    file
}

/// Up to where a section or a chunk may begin.
fn pad(bytes: &mut Vec<u8>) {
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}

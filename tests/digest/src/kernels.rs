//! One number for layers, roots and blended rows, which some targets have in assembly.

use pocketsplat_half::{
    BlendConstants, ChannelTables, Entries, Exponential, FREQUENCY_TOTAL, LANES, LevelFrequencies, ROW_LEN, RowSplat,
    Stream, TABLE_WORDS, add_products_of_two_rows, blend_rows, descend, outputs, read_values, rectified_units, sqrt,
};

use super::digest::Digest;

/// Those of the decoder.
static CONSTANTS: BlendConstants = BlendConstants::new(EXPONENTIAL, 0.99, -0.0201, 1e-4);
const EXPONENTIAL: Exponential = Exponential {
    log2_e: core::f32::consts::LOG2_E,
    rounder: 12_582_912.0,
    ln_2: [355.0 / 512.0, -2.121_944_4e-4],
    tail: [0.001_392_692_7, 0.008_363_774, 0.041_666_55, 0.166_665_73],
};

/// Numbers between two others, the same every time.
struct Random(u32);

impl Random {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        low + (high - low) * (self.0 >> 8) as f32 / 16_777_216.0
    }
}

/// Digest of layers of 0 to 12 inputs, of integer sums of 0 to 19, of roots of all exponents, of symbols of random bytes, and of tiles of
/// 40 splats each.
pub(crate) fn digest() -> Digest {
    let mut digest = Digest::EMPTY;
    let mut random = Random(5);
    for n_in in 0..=12 {
        for _ in 0..20 {
            let inputs: [f32; 12] = core::array::from_fn(|_| random.between(-3.0, 3.0));
            let inputs = inputs.get(..n_in).unwrap_or_default();
            let rows: [[f32; LANES]; 39] =
                core::array::from_fn(|_| core::array::from_fn(|_| random.between(-2.0, 2.0)));
            // Blocks of just as many rows as inputs, and of more.
            for rows_per_block in [n_in + 1, 13] {
                let mut units = [[-1.0; LANES]; 3];
                rectified_units(&rows, rows_per_block, inputs, &mut units);
                units.as_flattened().iter().for_each(|unit| digest.add(unit.to_bits().to_le_bytes()));
            }
            let flat = rows.as_flattened();
            outputs::<3>(flat.as_chunks().0, inputs).iter().for_each(|sum| digest.add(sum.to_bits().to_le_bytes()));
            outputs::<7>(flat.as_chunks().0, inputs).iter().for_each(|sum| digest.add(sum.to_bits().to_le_bytes()));
        }
    }
    for n in 0..20 {
        let bytes: [u8; 39] = core::array::from_fn(|_| random.between(0.0, 255.9) as u8);
        let values: [i16; 20] = core::array::from_fn(|_| random.between(-32_768.0, 32_767.9) as i16);
        // At any address, and as long as the shortest.
        let (first, second) = bytes.split_at(n);
        let sums = add_products_of_two_rows([1, -1], [first, second], &values);
        sums.iter().for_each(|sum| digest.add(sum.to_le_bytes()));
    }
    for upper in 0..0x7F80_u32 {
        digest.add(sqrt(f32::from_bits(upper << 16 | upper.wrapping_mul(40_503) & 0xFFFF)).to_bits().to_le_bytes());
    }
    for _ in 0..30 {
        add_symbols(&mut random, &mut digest);
    }
    for tile in 0..50 {
        let mut rows = [[[0.0, 0.0, 0.0, 1.0]; ROW_LEN]; ROW_LEN];
        for _ in 0..40 {
            let row_precision = 1.0 / random.between(0.5, if tile % 2 == 0 { 4.0 } else { 200.0 });
            let column_precision = 1.0 / random.between(0.5, 100.0);
            // From as faint as nothing to opaque.
            let log_opacity = random.between(-5.6, 0.5).min(0.0);
            let mut splat = RowSplat {
                dy: random.between(-16.0, 4.0),
                shear: random.between(-2.0, 2.0),
                row_precision,
                column_precision,
                log_opacity,
                reach: 2.0 * (log_opacity + 5.541_263_6),
                row_variance: 1.0 / row_precision,
                centre_x: random.between(-8.0, 24.0),
                colour: core::array::from_fn(|_| random.between(0.0, 1.0)),
                ratio_step: EXPONENTIAL.near(-row_precision),
                transmittance_stop: if tile % 3 == 0 { 1e-2 } else { 1e-4 },
                free: [7; 4],
            };
            let first = random.between(0.0, 15.9) as usize;
            let width = random.between(1.0, 24.0).min(16.0) as u16;
            let work = blend_rows(&mut splat, &CONSTANTS, rows.get_mut(first..).unwrap_or_default(), width);
            digest.add(work.pixels.to_le_bytes());
            digest.add(work.finished.to_le_bytes());
        }
        rows.as_flattened().as_flattened().iter().for_each(|value| digest.add(value.to_bits().to_le_bytes()));
    }
    digest
}

/// Adds what random words hold: runs of symbols of three tables up to one that is in none of them, and paths of a trie.
fn add_symbols(random: &mut Random, digest: &mut Digest) {
    let words: [[u8; 2]; 64] = core::array::from_fn(|_| (random.between(0.0, 65_535.9) as u16).to_le_bytes());
    let mut stream = Stream { state: 0, words: &words };
    stream.refill();
    stream.refill();
    // Of 3, 20 and 200 entries, some of them empty, and an escape.
    let mut section = [0; 2 * (3 + 20 + 200 + 3 * 2)];
    let mut rest = section.as_chunks_mut::<2>().0;
    let mut start = 0;
    let tables = [3_u16, 20, 200].map(|n| {
        let n_bounds = usize::from(n) + 2;
        let most = 4000.0 / f32::from(n);
        let mut bound = 0;
        let (bounds, after) = core::mem::take(&mut rest).split_at_mut(n_bounds);
        for (i, slot) in (0..=n).zip(&mut *bounds) {
            *slot = u16::to_le_bytes(bound);
            bound += random.between(if i % 5 == 0 { 0.0 } else { most * 0.5 }, most) as u16;
        }
        if let [.., last] = bounds {
            *last = FREQUENCY_TOTAL.to_le_bytes();
        }
        let end = start + 2 * n_bounds;
        let bounds = core::mem::replace(&mut start, end)..end;
        rest = after;
        // Of the last one some entries have no short cut.
        Entries { origin: 0.1, step: 0.7, first_symbol: -9, bounds, usual: 0..usize::from(n.min(190)) }
    });
    let mut memory = [0; 3 * TABLE_WORDS];
    let numbers: [[u8; 2]; 24] = core::array::from_fn(|channel| [(channel * 7 % 3) as u8, 0]);
    let Some(tables) = ChannelTables::new(&mut memory, tables.into_iter(), &numbers, &section) else { return };
    let levels: [LevelFrequencies; 40] = core::array::from_fn(|_| {
        core::array::from_fn(|_| {
            let end_both = random.between(0.0, 3000.0);
            [end_both, random.between(end_both, 4096.0)].map(|end| (end as u16).to_le_bytes())
        })
    });
    for turn in 0..40 {
        let mut values = [-1.0; 24];
        let n = read_values(&tables, turn, &mut values, &mut stream);
        digest.add([n as u8]);
        values.iter().for_each(|value| digest.add(value.to_bits().to_le_bytes()));
        if n == 0 {
            // An escape, as it were.
            stream.advance(0, 64);
        }
        let path = descend(levels.get(turn..).unwrap_or_default(), turn as u32, &mut stream);
        path.iter().for_each(|bits| digest.add(bits.to_le_bytes()));
        digest.add(stream.state.to_le_bytes());
        digest.add([stream.words.len() as u8]);
    }
}

use std::vec;

use super::lengths::Words;
use super::{FrameMemory, PainterMemory, Regions, SceneMemory};
use crate::budget::placement::Placement;
use crate::budget::{CoderShape, FrameShape, HeadWeights, ModelShape, RecordShape, Resident, ScratchShape};
use pocketsplat_format::DecodeError;

/// A stream of numbers, the same every time.
struct Numbers(u32);

impl Numbers {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % n
    }

    /// A shape that keeps nothing, anchors or Gaussians.
    fn shape(&mut self, kept: u32, most: u32) -> ScratchShape {
        let mut up_to = |n: u32| self.below(n) as u16;
        let context = up_to(2);
        ScratchShape {
            model: ModelShape {
                feature_dim: 1 + up_to(256),
                n_offsets: 1 + up_to(32),
                anisotropic: up_to(2) == 1,
                n_geometry_inputs: up_to(5),
                n_colour_inputs: up_to(5),
                colour_hidden: 1 + up_to(256),
                detail_hidden: up_to(257),
                head_weights: if up_to(2) == 1 { HeadWeights::F16 } else { HeadWeights::F32 },
            },
            coder: CoderShape {
                n_tables: (1 - context) * up_to(360),
                context_inputs: context * 4 * (1 + up_to(32)),
                context_hidden: context * (1 + up_to(256)),
                context_kept: context * up_to(257),
            },
            record: RecordShape {
                symbol_bits: [1 + up_to(16) as u8, 1 + up_to(16) as u8, 1 + up_to(16) as u8],
                lattice_bits: up_to(22) as u8,
                masks: up_to(2) == 1,
            },
            resident: match kept {
                0 => Resident::Nothing,
                1 => Resident::Anchors {
                    n_anchors: 1 + self.below(most / 3),
                    n_chunks: 1 + self.below(200),
                    with_sums: self.below(2) == 1,
                },
                _ => Resident::Gaussians { n_gaussians: self.below(2 * most), n_chunks: 1 + self.below(200) },
            },
            frame: FrameShape {
                canvas_tiles: 1 + self.below(100),
                max_splats: self.below(most),
                shared_chunks: self.below(2) * self.below(200),
            },
        }
    }
}

fn most_of(a: ScratchShape, b: ScratchShape) -> ScratchShape {
    let ([a0, a1, a2], [b0, b1, b2]) = (a.record.symbol_bits, b.record.symbol_bits);
    ScratchShape {
        model: ModelShape {
            feature_dim: a.model.feature_dim.max(b.model.feature_dim),
            n_offsets: a.model.n_offsets.max(b.model.n_offsets),
            anisotropic: a.model.anisotropic | b.model.anisotropic,
            n_geometry_inputs: a.model.n_geometry_inputs.max(b.model.n_geometry_inputs),
            n_colour_inputs: a.model.n_colour_inputs.max(b.model.n_colour_inputs),
            colour_hidden: a.model.colour_hidden.max(b.model.colour_hidden),
            detail_hidden: a.model.detail_hidden.max(b.model.detail_hidden),
            head_weights: match (a.model.head_weights, b.model.head_weights) {
                (HeadWeights::F16, HeadWeights::F16) => HeadWeights::F16,
                _ => HeadWeights::F32,
            },
        },
        coder: CoderShape {
            n_tables: a.coder.n_tables.max(b.coder.n_tables),
            context_inputs: a.coder.context_inputs.max(b.coder.context_inputs),
            context_hidden: a.coder.context_hidden.max(b.coder.context_hidden),
            context_kept: a.coder.context_kept.max(b.coder.context_kept),
        },
        record: RecordShape {
            symbol_bits: [a0.max(b0), a1.max(b1), a2.max(b2)],
            lattice_bits: a.record.lattice_bits.max(b.record.lattice_bits),
            masks: a.record.masks | b.record.masks,
        },
        resident: match (a.resident, b.resident) {
            (
                Resident::Anchors { n_anchors, n_chunks, with_sums },
                Resident::Anchors { n_anchors: more_anchors, n_chunks: more_chunks, with_sums: more_sums },
            ) => Resident::Anchors {
                n_anchors: n_anchors.max(more_anchors),
                n_chunks: n_chunks.max(more_chunks),
                with_sums: with_sums | more_sums,
            },
            (
                Resident::Gaussians { n_gaussians, n_chunks },
                Resident::Gaussians { n_gaussians: more_gaussians, n_chunks: more_chunks },
            ) => Resident::Gaussians {
                n_gaussians: n_gaussians.max(more_gaussians),
                n_chunks: n_chunks.max(more_chunks),
            },
            (same, _) => same,
        },
        frame: FrameShape {
            canvas_tiles: a.frame.canvas_tiles.max(b.frame.canvas_tiles),
            max_splats: a.frame.max_splats.max(b.frame.max_splats),
            shared_chunks: a.frame.shared_chunks.max(b.frame.shared_chunks),
        },
    }
}

#[test]
fn more_never_takes_less() {
    let random = &mut Numbers(1);
    for _ in 0..20_000 {
        let kept = random.below(3);
        let (mut a, mut b) = (random.shape(kept, 100_000), random.shape(kept, 100_000));
        if a.frame.shared_chunks.max(b.frame.shared_chunks) > 0 {
            // Of the smallest heads two halves and what they are evaluated with take more than floats.
            (a.model.head_weights, b.model.head_weights) = (HeadWeights::F32, HeadWeights::F32);
        }
        let both = most_of(a, b);
        let [len_a, len_b, len] = [a, b, both].map(|shape| shape.scratch_len());
        assert!(len >= len_a.max(len_b), "{a:?} takes {len_a}, {b:?} {len_b}, both {len}");
    }
}

#[test]
fn the_sum_is_what_carving_takes() {
    let random = &mut Numbers(7);
    for round in 0..600 {
        let shape = random.shape(round % 3, 300);
        let n_placement = random.below(64) as usize;
        for placement in [Placement::FAST].into_iter().chain(Placement::to_try(true).nth(n_placement)) {
            let lens = shape.lens(placement);
            let mut memory = lens.map(|len| vec![0; len]);
            let mut take_all = |less: [usize; 2]| {
                let [fast, slow] = &mut memory;
                let [end_fast, end_slow] = [0, 1].map(|region| lens[region].saturating_sub(less[region]));
                let mut regions = Regions::new(&mut fast[..end_fast], &mut slow[..end_slow], placement);
                SceneMemory::take(&shape, &mut regions)?;
                FrameMemory::take(&shape, &mut regions)?;
                if shape.frame.shared_chunks > 0 {
                    PainterMemory::take(&shape, &mut regions)?;
                }
                Ok::<_, DecodeError>(regions.n_words())
            };
            for (region, less) in [[7, 0], [0, 7]].into_iter().enumerate().filter(|(region, _)| lens[*region] > 7) {
                assert!(take_all(less).is_err(), "a word less of region {region}: {placement:?} of {shape:?}");
            }
            let left = take_all([0, 0]).unwrap_or_else(|error| panic!("{error}: {placement:?} of {shape:?}"));
            for (Words { bound, frame, .. }, left) in shape.words(placement).into_iter().zip(left) {
                let unused = bound.saturating_sub(frame);
                assert!(left <= unused + 1, "{left} words over: {placement:?} of {shape:?}");
            }
        }
    }
}

#[test]
fn a_resident_anchor_takes_what_its_symbols_take_and_little_more() {
    let mut shape = ScratchShape::most(16, 4);
    shape.record.lattice_bits = 10;
    shape.coder.context_hidden = 32;
    // 34 symbols of 16 bits, cell, mask, steps.
    assert_eq!(2 * shape.record_layout().n_words(), 2 * (34 * 16 + 30 + 4 + 16_usize).div_ceil(16), "of any symbols");
    shape.coder.context_hidden = 0;
    shape.record = RecordShape { masks: false, symbol_bits: [6, 8, 7], ..shape.record };
    assert_eq!(
        2 * shape.record_layout().n_words(),
        2 * (16 * 6 + 6 * 8 + 12 * 7 + 30_usize).div_ceil(16),
        "of small ones"
    );
}

#[test]
fn splats_within_a_length_fill_it() {
    for resident in [
        Resident::Nothing,
        Resident::Anchors { n_anchors: 40, n_chunks: 40, with_sums: false },
        Resident::Anchors { n_anchors: 4, n_chunks: 4, with_sums: true },
        Resident::Gaussians { n_gaussians: 40, n_chunks: 40 },
    ] {
        let shape = ScratchShape { resident, ..ScratchShape::most(16, 4) }.with_splats(5000);
        for len in [100_000, 150_001, 999_999] {
            let within = shape.with_splats(shape.splats_within(Placement::FAST, [len, 0]));
            let is_full = within.frame.max_splats == 5000 || within.scratch_len() + 40 > len;
            assert!(within.scratch_len() <= len && is_full, "{within:?} in {len}");
        }
        assert_eq!(shape.splats_within(Placement::FAST, [1000, 0]), 0, "not even the heads");
    }
}

#[test]
fn beyond_the_address_space_is_said_so() {
    let shape = ScratchShape::most(256, 32).with_splats(u32::MAX);
    assert!(size_of::<usize>() > 4 || shape.scratch_len() == usize::MAX, "no wrapped sum");
}

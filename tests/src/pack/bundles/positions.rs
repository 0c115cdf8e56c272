//! The lattice, and chunks by their size.

use glam::DVec3;
use pocketsplat_format::bundle::{Effects, MAX_CHUNK_ANCHORS};

use super::{ANISOTROPIC, SMALL, anchors, front, one_chunk, sample, small};
use crate::frame::to_core;
use crate::pack::draft::Draft;
use crate::pack::heads::Widths;
use crate::pack::models::Anchor;
use crate::pack::numbers::Numbers;
use crate::pack::sample::{NO_EFFECT, Sample};
use crate::scenes::look_at;

/// Section 4.
pub(super) fn samples() -> Vec<Sample> {
    let mut samples = Vec::new();
    let effects = ANISOTROPIC;
    let mut one_cell = small(effects, SMALL, false, 400);
    let mut three = anchors(3, SMALL, effects, false, 400);
    three.iter_mut().for_each(|anchor| anchor.cell = [3, -2, 5]);
    one_cell.tiers = vec![three.into_iter().map(|anchor| vec![anchor]).collect()];
    one_cell.max_chunk_anchors = 1;
    one_cell.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let about = "A lattice of one cell (b = 0) that an anchor of each of three chunks stands in; a chunk has one anchor at most.";
    samples.push(sample("lattice-of-one-cell", about, one_cell, &[front()]));

    let limit = 1 << 23;
    let mut wide = small(effects, SMALL, false, 401);
    let edge = (1 << 21) - 1;
    let min = [-limit, limit, -5];
    wide.lattice = Some((min, 21));
    wide.voxel_size = 1.0 / (1 << 21) as f32;
    let mut numbers = Numbers::of(401);
    let mut cells: Vec<[i32; 3]> =
        (0..8).map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { edge } else { 0 })).collect();
    cells.extend((0..6).map(|_| std::array::from_fn(|_| numbers.between(0, edge))));
    for (anchor, cell) in wide.tiers[0][0].iter_mut().zip(cells) {
        anchor.cell = std::array::from_fn(|axis| min[axis] + cell[axis]);
    }
    let target = DVec3::new(-3.5, 4.5, 0.5);
    let camera = to_core(&look_at(target + DVec3::new(1.9, -2.4, 1.1), target, 1.2, [48, 36]));
    wide.preview = camera;
    let about = "The widest lattice: 21 bits, its lowest cell at ±2²³, anchors in all of its corners.";
    samples.push(sample("lattice-of-21-bits", about, wide, &[camera]));

    let least = Widths { features: 1, offsets: 1, colour_hidden: 2, detail_hidden: 0 };
    let n = usize::from(MAX_CHUNK_ANCHORS);
    let mut full: Vec<Anchor> = anchors(n, least, NO_EFFECT, false, 402);
    for (anchor, at) in full.iter_mut().zip(0_i32..) {
        // A solid block in the first half of which a trie has both children everywhere.
        anchor.cell = [at % 8 - 4, at / 8 % 8 - 4, at / 64 - 8];
        anchor.symbols[1..5].fill(-22);
    }
    let draft = Draft::of(NO_EFFECT, least, one_chunk(full), front(), 402);
    samples.push(sample("chunk-of-1024", "A chunk of 1024 anchors, a solid block.", draft, &[front()]));

    let mut none = small(Effects { background: true, ..NO_EFFECT }, SMALL, false, 403);
    none.tiers = vec![Vec::new()];
    none.lattice = Some(([-2; 3], 2));
    none.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    samples.push(sample("no-anchors", "No anchor: a frame is its background.", none, &[front()]));
    samples
}

//! The memory model as `DRAWING.md`, section 13, has it, against what the decoder plans.

use pocketsplat_core::{HeadWeights, Resident, ScratchShape};

/// A stream of numbers, the same every time.
struct Numbers(u32);

impl Numbers {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % n
    }

    fn shape(&mut self) -> ScratchShape {
        let mut up_to = |n: u32| self.below(n + 1) as u16;
        let mut shape = ScratchShape::most(1 + up_to(255), 1 + up_to(31));
        let ScratchShape { model, coder, record, .. } = &mut shape;
        model.anisotropic = up_to(1) == 1;
        [model.n_geometry_inputs, model.n_colour_inputs] = [up_to(4), up_to(4)];
        [model.colour_hidden, model.detail_hidden] = [1 + up_to(255), up_to(1) * up_to(256)];
        model.head_weights = if up_to(1) == 1 { HeadWeights::F16 } else { HeadWeights::F32 };
        let context = up_to(1);
        coder.n_tables = (1 - context) * (1 + up_to(359));
        coder.context_inputs = context * 4 * (1 + up_to(31));
        coder.context_hidden = context * (1 + up_to(255));
        coder.context_kept = context * up_to(262);
        record.symbol_bits = [(); 3].map(|()| 1 + up_to(15) as u8);
        record.lattice_bits = up_to(21) as u8;
        record.masks = up_to(1) == 1;
        shape.resident = match up_to(if cfg!(feature = "baked") { 2 } else { 1 }) {
            0 => Resident::Nothing,
            1 => Resident::Anchors {
                n_anchors: 1 + self.below(30_000),
                n_chunks: 1 + self.below(200),
                with_sums: self.below(2) == 1,
            },
            _ => Resident::Gaussians { n_gaussians: self.below(200_000), n_chunks: 1 + self.below(200) },
        };
        [shape.frame.canvas_tiles, shape.frame.max_splats] = [1 + self.below(100), self.below(60_000)];
        shape.frame.shared_chunks = self.below(2) * (1 + self.below(200));
        shape
    }
}

/// Bytes by the formulas of the document, with its names.
fn by_the_document(shape: &ScratchShape) -> usize {
    let ScratchShape { model, coder, record, resident, frame } = *shape;
    let up8 = |n: usize| n.next_multiple_of(8);
    let [f, k, h_c, h_d] =
        [model.feature_dim, model.n_offsets, model.colour_hidden, model.detail_hidden].map(usize::from);
    let [n_g, n_c] = [model.n_geometry_inputs, model.n_colour_inputs].map(|more| f + usize::from(more));
    let (v, s) = if model.anisotropic { (7, 6) } else { (1, 4) };
    let c = f + s + 3 * k;
    let u = up8(f.max(h_c).max(h_d));

    let [a, b, d, e] = [up8(f) * (n_g + 1), up8(h_c) * (n_c + 1), k * (f + 1), 3 * k * (h_c + 1)];
    let detail = if h_d == 0 { 0 } else { up8(h_d) * (f + 4) + 3 * (h_d + 1) };
    let extra = if f == 1 { (1 + v) * k } else { 0 } + if h_c == 1 { 3 * k } else { 0 };
    let f32 = 2 * a + b + d + v * d + e + extra;
    let halves = 2 * a.div_ceil(2)
        + b.div_ceil(2)
        + d.div_ceil(2)
        + (v * d).div_ceil(2)
        + e.div_ceil(2)
        + 3 * k
        + n_g.max(n_c)
        + 3 * u;
    let integers = 2 * 4 * f.div_ceil(4) * (n_g / 2 + 1)
        + 4 * h_c.div_ceil(4) * (n_c / 2 + 1)
        + (1 + v) * k * (f.div_ceil(2) + 2)
        + 3 * k * (h_c.div_ceil(2) + 2);
    let weights = detail
        + match model.head_weights {
            HeadWeights::F32 => f32,
            HeadWeights::F16 => halves.max(integers).min(f32),
            other => panic!("what do {other:?} take?"),
        };
    let heads = weights + c + n_g.max(n_c) + u + up8(h_d) + 11 * k;

    let [n_tables, n_in, n_hidden, n_kept] =
        [coder.n_tables, coder.context_inputs, coder.context_hidden, coder.context_kept].map(usize::from);
    let models = if n_tables > 0 { 36 * n_tables } else { (n_in + n_hidden + n_kept).div_ceil(2) };

    let tiles = 1024 * frame.canvas_tiles as usize + 192 + 256;
    let (places, shared_chunks) = (frame.max_splats as usize, frame.shared_chunks as usize);
    let own = if resident == Resident::Nothing && n_tables == 0 { models } else { 0 };
    let pair = if model.head_weights == HeadWeights::F16 { 3 * k + n_g.max(n_c) + 3 * u } else { 0 };
    let reader = match resident {
        Resident::Gaussians { .. } => 0,
        _ => c + n_g.max(n_c) + u + up8(h_d) + 11 * k + own + pair,
    };
    let drawn = match shared_chunks {
        0 => tiles + 10 * places,
        _ => 2 * (tiles + 12 * places + shared_chunks) + reader,
    };
    let (kept, bound) = match resident {
        Resident::Nothing => (heads + models, 0),
        Resident::Anchors { n_anchors, n_chunks, with_sums } => {
            let [b_f, b_s, b_o] = record.symbol_bits.map(usize::from);
            let masks = if record.masks { k } else { 0 };
            let steps = if n_tables > 0 { 0 } else { 16 };
            let bits = f * b_f + s * b_s + 3 * k * b_o + 3 * usize::from(record.lattice_bits) + masks + steps;
            let words = (2 * bits.div_ceil(16) * n_anchors as usize).div_ceil(4);
            let sums = if with_sums && cfg!(feature = "baked") {
                n_anchors as usize * (2 * up8(f) + up8(h_c) + up8(h_d))
            } else {
                0
            };
            (heads + words + (n_chunks as usize).div_ceil(32) + 2 * n_tables + sums, models)
        }
        Resident::Gaussians { n_gaussians, n_chunks } => {
            (8 * n_gaussians as usize + n_chunks as usize + 1, heads + models)
        }
    };
    4 * (kept + bound.max(drawn)) + 3
}

#[test]
fn the_document_counts_the_bytes_of_a_plan() {
    let random = &mut Numbers(3);
    for _ in 0..20_000 {
        let shape = random.shape();
        assert_eq!(by_the_document(&shape), shape.scratch_len(), "{shape:?}");
    }
}

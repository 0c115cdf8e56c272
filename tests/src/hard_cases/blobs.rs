//! Scenes of Gaussians that a case chooses one by one.

use pocketsplat_kernels::scene::{Anchors, Heads, ModelShape, Scene};

/// One Gaussian as a case thinks of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blob {
    /// Centre, normalised frame; an anchor stands on the lattice cell nearest to it.
    pub position: [f64; 3],
    /// Deviations along its own axes, normalised units; the first alone counts in a scene of isotropic Gaussians.
    pub scale: [f64; 3],
    /// w, x, y, z, of any length; none in a scene of isotropic Gaussians.
    pub quaternion: [f32; 4],
    /// Before tanh.
    pub opacity_logit: f32,
    /// RGB inside 0..1.
    pub colour: [f64; 3],
}

impl Default for Blob {
    fn default() -> Self {
        Self {
            position: [0.0, 0.0, 2.0],
            scale: [0.1; 3],
            quaternion: [1.0, 0.0, 0.0, 0.0],
            opacity_logit: logit_of_opacity(0.8),
            colour: [0.9, 0.5, 0.2],
        }
    }
}

/// The opacity head's output for an opacity below 1.
pub fn logit_of_opacity(opacity: f64) -> f32 {
    opacity.atanh() as f32
}

/// Gaussians and how they are put into a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Blobs {
    /// The Gaussians; those of an anchor follow each other and share position and scale.
    pub blobs: Vec<Blob>,
    /// K.
    pub per_anchor: usize,
    /// Edge of a lattice cell, normalised units.
    pub voxel_size: f64,
    /// Effects; widths follow from the Gaussians.
    pub effects: ModelShape,
    /// What a hidden unit of each head multiplies its feature by; the second layer divides by it again.
    pub gains: [f32; 3],
}

impl Default for Blobs {
    fn default() -> Self {
        Self {
            blobs: vec![Blob::default()],
            per_anchor: 1,
            voxel_size: 1.0 / 1024.0,
            effects: ModelShape::plain(1, 1),
            gains: [1.0; 3],
        }
    }
}

/// The head outputs of an anchor's Gaussians.
fn outputs(shape: &ModelShape, blobs: &[Blob]) -> [Vec<f32>; 3] {
    let logit = |p: f64| (p / (1.0 - p)).ln() as f32;
    [
        blobs.iter().map(|blob| blob.opacity_logit).collect(),
        // The sigmoid of a zero logit halves the base size.
        blobs
            .iter()
            .flat_map(|blob| [0.0; 3].into_iter().chain(blob.quaternion).take(shape.covariance_outputs()))
            .collect(),
        blobs.iter().flat_map(|blob| blob.colour.map(logit)).collect(),
    ]
}

impl Blobs {
    /// Gaussians with everything else as usual.
    pub fn of(blobs: impl IntoIterator<Item = Blob>) -> Self {
        Self { blobs: blobs.into_iter().collect(), ..Self::default() }
    }

    /// The scene: feature m of an anchor is 1 where it is of material m, and hidden unit m is open to feature m alone, so
    /// that column m of W2 holds the outputs of that material. A bias keeps the others away from the kink of relu.
    pub fn scene(&self) -> Scene<f32> {
        let groups: Vec<&[Blob]> = self.blobs.chunks_exact(self.per_anchor).collect();
        let mut materials: Vec<[Vec<f32>; 3]> = Vec::new();
        let material_of: Vec<usize> = groups
            .iter()
            .map(|group| {
                let outputs = outputs(&self.effects, group);
                materials.iter().position(|known| *known == outputs).unwrap_or_else(|| {
                    materials.push(outputs);
                    materials.len() - 1
                })
            })
            .collect();
        let f = materials.len().max(1);
        let shape = ModelShape { feature_dim: f, n_offsets: self.per_anchor, ..self.effects };
        let mut heads = Heads::filled(&shape, 0.0_f32);
        for (index, (head, gain)) in heads.each_mut().zip(self.gains).enumerate() {
            for (m, material) in materials.iter().enumerate() {
                head.w1[m * head.n_in + m] = gain;
                head.b1[m] = -gain / 4.0;
                for (row, output) in material[index].iter().enumerate() {
                    head.w2[row * f + m] = output / (0.75 * gain);
                }
            }
        }
        let mut anchors = Anchors::default();
        for (group, material) in groups.iter().zip(material_of) {
            let Blob { position, scale, .. } = group[0];
            anchors.lattice.push(position.map(|x| (x / self.voxel_size).round() as i32));
            anchors.features.extend((0..f).map(|m| if m == material { 1.0 } else { 0.0 }));
            let longest = scale.into_iter().fold(0.0, f64::max);
            anchors.log_scales.extend([longest.ln() as f32; 3]);
            anchors.log_scales.extend(scale.map(|s| (2.0 * s).ln() as f32).iter().take(shape.n_log_scales() - 3));
            anchors.offsets.extend(std::iter::repeat_n(0.0, 3 * self.per_anchor));
            anchors.mask_logits.extend(std::iter::repeat_n(1.0, self.per_anchor));
        }
        Scene { shape, voxel_size: self.voxel_size, anchors, heads, context: None }
    }
}

//! A bundle as a scene again.

use pocketsplat_format::bundle::{AnchorSite, Chunk, HeadView};
use pocketsplat_format::{Bundle, DecodeError};

use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_kernels::scene::{Anchors, Head, Heads, INITIAL_MASK_LOGIT, ModelShape, Scene};

/// Widths and effects of a bundle's scene.
pub fn shape_of(bundle: &Bundle<'_>) -> ModelShape {
    let header = bundle.header();
    let effects = header.features.effects;
    ModelShape {
        feature_dim: header.feature_dim.into(),
        n_offsets: header.n_offsets.into(),
        view_colour: effects.view_colour,
        view_geometry: effects.view_geometry,
        view_distance: effects.view_distance,
        dilation_compensation: effects.dilation_compensation,
        anisotropic: effects.anisotropic,
        colour_hidden: header.colour_hidden.into(),
        detail_hidden: header.detail_hidden.into(),
    }
}

/// The frame of a bundle's scene.
pub fn normalisation_of(bundle: &Bundle<'_>) -> Normalisation {
    let header = bundle.header();
    Normalisation { centre: header.normalisation_centre.into(), scale: header.normalisation_scale }
}

/// Entropy-decodes a bundle chunk by chunk, and hands on each chunk's sites and symbols, `[n]` and `[n, n_channels]`.
///
/// # Errors
/// [`DecodeError`] of the first chunk that does not decode.
pub fn for_each_chunk(
    bundle: &Bundle<'_>,
    mut decoded: impl FnMut(&Chunk<'_>, &[AnchorSite], &[i16]),
) -> Result<(), DecodeError> {
    let (n_most, n_channels) = (usize::from(bundle.header().max_chunk_anchors), bundle.header().n_channels());
    let mut words = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut words)?;
    let (mut sites, mut symbols) = (vec![AnchorSite::default(); n_most], vec![0; n_most * n_channels]);
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (sites, symbols) = (&mut sites[..n], &mut symbols[..n * n_channels]);
        chunk.decode_symbols(&mut models, sites, symbols)?;
        decoded(&chunk, sites, symbols);
    }
    Ok(())
}

/// The scene that a bundle draws, its values as the decoder has them; anchors are in file order.
///
/// Offsets that are not drawn are 0, with a mask logit of −10. There is no context model: a bundle keeps its integers only.
///
/// # Errors
/// [`DecodeError`] of the first chunk that does not decode.
pub fn decoded_scene(bundle: &Bundle<'_>) -> Result<Scene<f32>, DecodeError> {
    let shape = shape_of(bundle);
    let mut anchors = Anchors::default();
    let mut words = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut words)?;
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let mut sites = vec![AnchorSite::default(); n];
        let mut values = vec![0.0; n * shape.values_per_anchor()];
        chunk.decode_values(&mut models, &mut sites, &mut values)?;
        for (site, row) in sites.iter().zip(values.chunks_exact(shape.values_per_anchor())) {
            let (features, rest) = row.split_at(shape.feature_dim);
            let (log_scales, offsets) = rest.split_at(shape.n_log_scales());
            anchors.lattice.push(site.lattice);
            anchors.features.extend(features);
            anchors.log_scales.extend(log_scales);
            anchors.offsets.extend(offsets);
            let logit = |k: usize| if (site.mask >> k) & 1 == 1 { INITIAL_MASK_LOGIT as f32 } else { -10.0 };
            anchors.mask_logits.extend((0..shape.n_offsets).map(logit));
        }
    }
    let voxel_size = bundle.header().voxel_size.into();
    Ok(Scene { shape, voxel_size, anchors, heads: decoded_heads(bundle), context: None })
}

/// The heads of a bundle, raw or coded.
pub fn decoded_heads(bundle: &Bundle<'_>) -> Heads<f32> {
    let mut weights = bundle.heads().weights();
    let mut head = |view: &HeadView<'_>| Head {
        n_in: view.n_in,
        n_hidden: view.n_hidden,
        n_out: view.n_out,
        w1: weights.next_layer().collect(),
        b1: view.b1.iter().collect(),
        w2: weights.next_layer().collect(),
        b2: view.b2.iter().collect(),
    };
    let views = bundle.heads();
    Heads {
        opacity: head(&views.opacity),
        covariance: head(&views.covariance),
        colour: head(&views.colour),
        detail: views.detail.as_ref().map(head),
    }
}

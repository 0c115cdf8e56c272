//! What a reader must find in a bundle: anchors, and frames.

use std::fmt::Write as _;
use std::io::Cursor;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};
use pocketsplat_codec::bundle::for_each_chunk;
use pocketsplat_core::{Budget, Bundle, Camera, DecodeError};
use pocketsplat_format::bundle::{Features, crc32};

use super::models::Anchor;
use super::sample::Sample;
use crate::frame::{budget_for, draw_by};

/// A frame of a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedFrame {
    /// Drawn with so many.
    pub tiers: u8,
    /// From here.
    pub camera: Camera,
    /// `[height, width, 3]`.
    pub rgb: Vec<u8>,
}

impl Sample {
    /// The view of its file.
    ///
    /// # Panics
    /// If it is refused.
    pub fn bundle(&self) -> Bundle<'_> {
        Bundle::parse(&self.bytes).unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    /// Its frames.
    ///
    /// # Panics
    /// If one cannot be drawn.
    pub fn frames(&self) -> Vec<ExpectedFrame> {
        let bundle = self.bundle();
        let frame = |&(tiers, camera): &(u8, Camera)| {
            let budget: Budget = budget_for(&camera).with_tiers(tiers);
            let (frame, _) =
                draw_by(&budget, &bundle, &camera).unwrap_or_else(|error| panic!("{}: {error}", self.name));
            ExpectedFrame { tiers, camera, rgb: frame.rgb }
        };
        self.views.iter().map(frame).collect()
    }

    /// `bundles/NAME.json`.
    pub fn json(&self, frames: &[ExpectedFrame]) -> String {
        let bundle = self.bundle();
        let header = bundle.header();
        let name = &self.name;
        let features: Vec<String> =
            feature_names(header.features).into_iter().map(|name| format!("\"{name}\"")).collect();
        let tier = |tier| {
            let tier = bundle.tier(tier).unwrap_or_default();
            format!("{{\"n_chunks\": {}, \"n_anchors\": {}}}", tier.n_chunks, tier.n_anchors)
        };
        let tiers: Vec<String> = (0..bundle.n_tiers()).map(tier).collect();
        let anchor = |anchor: &Anchor| {
            let drawn: String =
                (0..header.n_offsets).map(|k| if anchor.drawn >> k & 1 == 1 { '1' } else { '0' }).collect();
            let Anchor { cell: [x, y, z], symbols, .. } = anchor;
            let symbols: Vec<String> = symbols.iter().map(i16::to_string).collect();
            format!("{{\"cell\": [{x}, {y}, {z}], \"drawn\": \"{drawn}\", \"symbols\": [{}]}}", symbols.join(", "))
        };
        let frame = |(index, frame): (usize, &ExpectedFrame)| {
            let Camera { rotation, translation, focal_px, principal_px, width_px, height_px } = frame.camera;
            format!(
                "{{\"tiers\": {}, \"camera\": {{\"rotation\": {}, \"translation\": {}, \"focal_px\": {}, \"principal_px\": {}, \
                 \"width_px\": {width_px}, \"height_px\": {height_px}}},\n   \"png\": \"frames/{name}-{index}.png\", \
                 \"crc32\": \"{:08x}\"}}",
                frame.tiers,
                floats(&rotation.to_array()),
                floats(&translation),
                floats(&focal_px),
                floats(&principal_px),
                crc32(&frame.rgb),
            )
        };
        let mut json = format!(
            "{{\"file\": \"bundles/{name}.psb\",\n \"about\": \"{}\",\n \"features\": [{}],\n \"file_len\": {},\n \
             \"n_tiers\": {},\n \"tiers\": [{}],\n \"anchors\": ",
            self.about,
            features.join(", "),
            header.file_len,
            bundle.n_tiers(),
            tiers.join(", "),
        );
        json.push_str(&list(self.anchors.iter().map(anchor)));
        json.push_str(",\n \"frames\": ");
        json.push_str(&list(frames.iter().enumerate().map(frame)));
        json.push_str("}\n");
        json
    }
}

/// The anchors of each chunk, in file order, as the decoder reads them.
///
/// # Errors
/// Of the first chunk that is refused.
pub fn decoded(bundle: &Bundle<'_>) -> Result<Vec<Vec<Anchor>>, DecodeError> {
    let n_channels = bundle.header().n_channels();
    let mut chunks = Vec::new();
    for_each_chunk(bundle, |_, sites, symbols| {
        let rows = sites.iter().zip(symbols.chunks_exact(n_channels));
        chunks.push(
            rows.map(|(site, row)| Anchor { cell: site.lattice, drawn: site.mask, symbols: row.to_vec() }).collect(),
        );
    })?;
    Ok(chunks)
}

/// The names of the required features of a bundle, by their bits.
fn feature_names(features: Features) -> Vec<&'static str> {
    FEATURES.iter().filter(|(bit, _)| features.to_bits() >> bit & 1 == 1).map(|(_, name)| *name).collect()
}

/// Bits of required features, and what they are called.
pub const FEATURES: [(u32, &str); 10] = [
    (0, "view colour"),
    (1, "view distance"),
    (2, "dilation compensation"),
    (3, "masks"),
    (4, "context"),
    (5, "coded heads"),
    (6, "detail"),
    (7, "anisotropy"),
    (8, "background"),
    (10, "view geometry"),
];

/// An f32 is an f64, and `Debug` writes the shortest number that is read as the same f64.
fn floats(numbers: &[f32]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|&number| format!("{:?}", f64::from(number))).collect();
    format!("[{}]", numbers.join(", "))
}

/// A list, one item a line.
pub(super) fn list(items: impl Iterator<Item = String>) -> String {
    let mut text = "[".to_owned();
    for (index, item) in items.enumerate() {
        write!(text, "{}\n  {item}", if index == 0 { "" } else { "," }).expect("a string takes all");
    }
    text.push(']');
    text
}

/// A frame as a PNG file.
pub fn png(frame: &ExpectedFrame) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Adaptive);
    let (width, height) = (frame.camera.width_px.into(), frame.camera.height_px.into());
    encoder.write_image(&frame.rgb, width, height, ExtendedColorType::Rgb8).expect("memory takes all");
    file.into_inner()
}

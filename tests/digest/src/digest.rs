//! One number for everything that a bundle's chunks decode to.

use pocketsplat_format::bundle::AnchorSite;
use pocketsplat_format::{Bundle, DecodeError};

/// Longest row of channels: 256 features, 6 log-scales, 32 offsets.
const MAX_CHANNELS: usize = 256 + 6 + 3 * 32;

/// FNV-1a, 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(pub u64);

impl Digest {
    pub(crate) const EMPTY: Self = Self(0xCBF2_9CE4_8422_2325);

    pub(crate) fn add(&mut self, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
        }
    }

    fn add_site(&mut self, site: AnchorSite) {
        self.add(site.lattice.into_iter().flat_map(i32::to_le_bytes));
        self.add(site.mask.to_le_bytes());
    }
}

/// Digests of lattice coordinates, masks and symbols, and of the same with the values' bits in place of symbols.
///
/// * `scratch`: [`Bundle::anchor_scratch_words`].
///
/// # Errors
/// The decoder's.
pub fn digests(bundle: &Bundle<'_>, scratch: &mut [u32]) -> Result<[Digest; 2], DecodeError> {
    let n_channels = bundle.header().n_channels();
    let [mut symbols, mut values] = [Digest::EMPTY; 2];
    let mut models = bundle.anchor_models(scratch)?;
    let mut row = [0_i16; MAX_CHANNELS];
    for chunk in bundle.chunks() {
        chunk.check()?;
        let mut anchors = chunk.anchors(&mut models);
        for _ in 0..chunk.n_anchors() {
            symbols.add_site(anchors.site());
            let row = row.get_mut(..n_channels).unwrap_or_default();
            anchors.symbols(row);
            symbols.add(row.iter().flat_map(|symbol| symbol.to_le_bytes()));
        }
        anchors.finish()?;
    }
    let mut row = [0.0_f32; MAX_CHANNELS];
    for chunk in bundle.chunks() {
        let mut anchors = chunk.anchors(&mut models);
        for _ in 0..chunk.n_anchors() {
            values.add_site(anchors.site());
            let row = row.get_mut(..n_channels).unwrap_or_default();
            anchors.values(row);
            values.add(row.iter().flat_map(|value| value.to_bits().to_le_bytes()));
        }
        anchors.finish()?;
    }
    Ok([symbols, values])
}

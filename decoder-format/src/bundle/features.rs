//! The feature field: what a decoder must know to draw a scene.

use crate::error::DecodeError;

/// What a scene's heads and opacities take into account; anything else is absent and costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Effects {
    /// The colour head sees the unit vector from the camera to the anchor.
    pub view_colour: bool,
    /// The opacity and the covariance head see it.
    pub view_geometry: bool,
    /// These heads see the distance from the camera to the anchor, normalised units.
    pub view_distance: bool,
    /// Opacity is multiplied by √(det Σ / det(Σ + 0.3 I)) (Yu et al. 2024, Mip-Splatting, eq. 8).
    pub dilation_compensation: bool,
    /// A detail head adds a residual to each Gaussian's colour.
    pub detail: bool,
    /// Gaussians have three deviations and a rotation; without it one deviation, the same in every direction.
    pub anisotropic: bool,
    /// Something lies behind the scene: a colour.
    pub background: bool,
}

impl Effects {
    /// Whether the heads see the view, so that a frame from elsewhere has other Gaussians.
    #[must_use]
    pub const fn see_view(self) -> bool {
        self.view_colour || self.view_geometry || self.view_distance
    }
}

/// What a bundle requires of its decoder: the scene's effects, and how its numbers are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Features {
    /// What the renderer has to take into account.
    pub effects: Effects,
    /// Each anchor says which of its offsets are drawn.
    pub masks: bool,
    /// The channels' models follow from a context; without it they are static tables.
    pub context: bool,
    /// The matrices of the heads are coded, not raw halves.
    pub coded_heads: bool,
}

impl Features {
    /// Bits that have a meaning in this version; bit 9 is reserved.
    const KNOWN: u32 = 0b101_1111_1111;

    /// What this decoder is built with, a bit for each.
    const BUILT: u32 = {
        let effects = Effects {
            view_colour: true,
            view_geometry: true,
            view_distance: true,
            dilation_compensation: true,
            detail: cfg!(feature = "detail"),
            anisotropic: cfg!(feature = "anisotropy"),
            background: true,
        };
        let built = Self { effects, masks: true, context: cfg!(feature = "context"), coded_heads: true };
        built.to_bits()
    };

    /// The bits as the header stores them.
    #[must_use]
    pub const fn to_bits(self) -> u32 {
        let effects = self.effects;
        let Effects { view_colour, view_geometry, view_distance, dilation_compensation, .. } = effects;
        let Effects { detail, anisotropic, background, .. } = effects;
        (view_colour as u32)
            | (view_distance as u32) << 1
            | (dilation_compensation as u32) << 2
            | (self.masks as u32) << 3
            | (self.context as u32) << 4
            | (self.coded_heads as u32) << 5
            | (detail as u32) << 6
            | (anisotropic as u32) << 7
            | (background as u32) << 8
            | (view_geometry as u32) << 10
    }

    /// The features that `bits` stand for.
    ///
    /// # Errors
    /// [`DecodeError::UnsupportedFeatures`] with the bits that have no meaning in this version;
    /// [`DecodeError::NotBuilt`] with what the decoder was built without.
    pub fn from_bits(bits: u32) -> Result<Self, DecodeError> {
        let unknown_bits = bits & !Self::KNOWN;
        if unknown_bits != 0 {
            return Err(DecodeError::UnsupportedFeatures { unknown_bits });
        }
        let missing_bits = bits & !Self::BUILT;
        if missing_bits != 0 {
            return Err(DecodeError::NotBuilt { missing_bits });
        }
        let has = |bit: u32| bits & bit != 0;
        Ok(Self {
            effects: Effects {
                view_colour: has(1),
                view_geometry: has(1024),
                view_distance: has(2),
                dilation_compensation: has(4),
                detail: has(64),
                anisotropic: has(128),
                background: has(256),
            },
            masks: has(8),
            context: has(16),
            coded_heads: has(32),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::string::ToString;

    use super::Features;
    use crate::DecodeError;

    #[test]
    fn known_bits_come_back_and_unknown_ones_are_named() {
        for bits in 0..2048 {
            let unknown_bits = bits & !Features::KNOWN;
            let missing_bits = bits & !Features::BUILT;
            let expected = match (unknown_bits, missing_bits) {
                (0, 0) => Ok(bits),
                (0, _) => Err(DecodeError::NotBuilt { missing_bits }),
                _ => Err(DecodeError::UnsupportedFeatures { unknown_bits }),
            };
            assert_eq!(Features::from_bits(bits).map(Features::to_bits), expected, "bits {bits:#b}");
        }
        let error = DecodeError::UnsupportedFeatures { unknown_bits: 0x8000_0800 };
        assert_eq!(Features::from_bits(0x8000_0801), Err(error), "the first after the known ones and the last");
        let reserved = DecodeError::UnsupportedFeatures { unknown_bits: 512 };
        assert_eq!(Features::from_bits(513), Err(reserved), "the reserved bit between known ones");
    }

    #[test]
    fn what_a_decoder_is_built_without_is_named() {
        let text = |missing_bits| DecodeError::NotBuilt { missing_bits }.to_string();
        let all = [(16, "context"), (64, "detail"), (128, "anisotropy")];
        for (bits, name) in all {
            assert!(text(bits).contains(name), "{bits:#b}: {}", text(bits));
        }
        assert!(!text(64).contains("context"), "nothing else: {}", text(64));
    }
}

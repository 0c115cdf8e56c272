//! `meta.json`: how many Gaussians, which image is what, and the tables that the images index.

use serde::{Deserialize, Serialize};

use crate::{Degree, Unreadable};

pub(super) const VERSION: u32 = 2;

/// Entries of a codebook: one for each byte.
const CODEBOOK: usize = 256;

#[derive(Serialize, Deserialize)]
pub(super) struct Meta {
    pub(super) version: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) asset: Option<Asset>,
    pub(super) count: usize,
    #[serde(default)]
    pub(super) antialias: bool,
    pub(super) means: Means,
    pub(super) scales: Coded,
    pub(super) quats: Files,
    pub(super) sh0: Coded,
    #[serde(rename = "shN", default, skip_serializing_if = "Option::is_none")]
    pub(super) others: Option<Harmonics>,
}

/// What wrote the file.
#[derive(Serialize, Deserialize)]
pub(super) struct Asset {
    #[serde(default)]
    pub(super) generator: String,
}

/// Centres: least and largest of each axis, and the images of the low and the high bytes.
#[derive(Serialize, Deserialize)]
pub(super) struct Means {
    pub(super) mins: [f64; 3],
    pub(super) maxs: [f64; 3],
    pub(super) files: [String; 2],
}

/// One image whose bytes index a table.
#[derive(Serialize, Deserialize)]
pub(super) struct Coded {
    pub(super) codebook: Vec<f32>,
    pub(super) files: [String; 1],
}

/// One image.
#[derive(Serialize, Deserialize)]
pub(super) struct Files {
    pub(super) files: [String; 1],
}

/// The palette of the harmonics beyond the constant one.
#[derive(Serialize, Deserialize)]
pub(super) struct Harmonics {
    pub(super) count: usize,
    pub(super) bands: usize,
    pub(super) codebook: Vec<f32>,
    pub(super) files: [String; 2],
}

impl Harmonics {
    /// The images of the palette and of the Gaussians' entries in it; programs list them in both orders.
    pub(super) fn centroids_and_labels(&self) -> (&String, &String) {
        let [first, second] = &self.files;
        if first.contains("label") { (second, first) } else { (first, second) }
    }
}

impl Meta {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, Unreadable> {
        #[derive(Deserialize)]
        struct Version {
            version: Option<u32>,
        }
        let json = |error| Unreadable::new(format!("has a meta.json that cannot be read: {error}"));
        let Version { version } = serde_json::from_slice(bytes).map_err(json)?;
        if version != Some(VERSION) {
            let found = version.map_or_else(|| "no version".to_owned(), |version| format!("version {version}"));
            return Err(Unreadable::new(format!(
                "has a meta.json of {found}, version {VERSION} is read; `splat-transform IN.sog OUT.sog` writes it"
            )));
        }
        let meta: Self = serde_json::from_slice(bytes).map_err(json)?;
        let others = meta.others.as_ref();
        for (name, codebook) in [
            ("scales", Some(&meta.scales.codebook)),
            ("sh0", Some(&meta.sh0.codebook)),
            ("shN", others.map(|others| &others.codebook)),
        ] {
            if let Some(codebook) = codebook.filter(|codebook| codebook.len() != CODEBOOK) {
                return Err(Unreadable::new(format!(
                    "has a codebook of {} entries for {name}, which has to have {CODEBOOK}",
                    codebook.len()
                )));
            }
        }
        if let Some(others) = others
            && !((1..=3).contains(&others.bands) && (1..=super::MAX_PALETTE).contains(&others.count))
        {
            return Err(Unreadable::new(format!(
                "has {} palette entries of degree {}; there can be 1 to {} of degree 1 to 3",
                others.count,
                others.bands,
                super::MAX_PALETTE
            )));
        }
        Ok(meta)
    }

    pub(super) fn degree(&self) -> Degree {
        self.others.as_ref().and_then(|others| Degree::ALL.get(others.bands).copied()).unwrap_or_default()
    }
}

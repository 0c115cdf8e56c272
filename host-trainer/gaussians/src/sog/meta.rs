//! `meta.json`: how many Gaussians, which image is what, and the tables that the images index.

use serde::{Deserialize, Serialize};

use crate::opacity::logit_of_byte;
use crate::{Degree, Frame, Unreadable};

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
    /// Offset and scale of the file's numbers in the scene; ours alone.
    #[serde(rename = "pocketsplatFrame", default, skip_serializing_if = "Option::is_none")]
    pub(super) frame: Option<[f64; 4]>,
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
    /// One table for all channels; empty in version 1.
    #[serde(default)]
    pub(super) codebook: Vec<f32>,
    /// Of version 1: least and largest number of each channel.
    #[serde(default, skip_serializing)]
    mins: Vec<f32>,
    #[serde(default, skip_serializing)]
    maxs: Vec<f32>,
    pub(super) files: [String; 1],
}

impl Coded {
    pub(super) fn new(codebook: Vec<f32>, file: &str) -> Self {
        Self { codebook, mins: Vec::new(), maxs: Vec::new(), files: [file.to_owned()] }
    }

    /// A table for each of `n` channels.
    fn tables(&self, name: &str, n: usize, version: u32) -> Result<Vec<Vec<f32>>, Unreadable> {
        if version == 1 {
            let bounds = self.mins.get(..n).zip(self.maxs.get(..n)).ok_or_else(|| {
                Unreadable::new(format!("has no least and largest numbers of {n} channels for {name}"))
            })?;
            return Ok(bounds.0.iter().zip(bounds.1).map(|(&least, &largest)| line(least, largest)).collect());
        }
        Ok(vec![checked(name, &self.codebook)?.to_vec(); n])
    }
}

/// The codebook of numbers at equal distances.
fn line(least: f32, largest: f32) -> Vec<f32> {
    (0..CODEBOOK).map(|byte| least + (largest - least) * byte as f32 / (CODEBOOK - 1) as f32).collect()
}

fn checked<'a>(name: &str, codebook: &'a [f32]) -> Result<&'a [f32], Unreadable> {
    if codebook.len() == CODEBOOK {
        return Ok(codebook);
    }
    Err(Unreadable::new(format!(
        "has a codebook of {} entries for {name}, which has to have {CODEBOOK}",
        codebook.len()
    )))
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

/// The same in version 1: the bands follow from the coefficients of an entry, the entries from the images.
#[derive(Deserialize)]
struct FirstHarmonics {
    shape: Vec<usize>,
    mins: f32,
    maxs: f32,
    files: [String; 2],
}

impl Harmonics {
    /// The images of the palette and of the Gaussians' entries in it; programs list them in both orders.
    pub(super) fn centroids_and_labels(&self) -> (&String, &String) {
        let [first, second] = &self.files;
        if first.contains("label") { (second, first) } else { (first, second) }
    }

    /// What the bytes of the palette mean.
    pub(super) fn table(&self) -> Result<Vec<f32>, Unreadable> {
        Ok(checked("shN", &self.codebook)?.to_vec())
    }
}

impl Meta {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, Unreadable> {
        let json = |error| Unreadable::new(format!("has a meta.json that cannot be read: {error}"));
        let mut value: serde_json::Value = serde_json::from_slice(bytes).map_err(json)?;
        let version = value.get("version").map_or(Some(1), serde_json::Value::as_u64);
        match version {
            Some(1) => to_second_version(&mut value)?,
            Some(2) => {}
            _ => {
                return Err(Unreadable::new(format!(
                    "has a meta.json of version {}, versions 1 and {VERSION} are read; write it as a .ply with the program that made it",
                    value.get("version").unwrap_or(&serde_json::Value::Null)
                )));
            }
        }
        let meta: Self = serde_json::from_value(value).map_err(json)?;
        if let Some(others) = &meta.others
            && !((1..=3).contains(&others.bands)
                && (meta.version == 1 || (1..=super::MAX_PALETTE).contains(&others.count)))
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

    /// What the bytes of `scales` mean, by channel.
    pub(super) fn scale_tables(&self) -> Result<Vec<Vec<f32>>, Unreadable> {
        self.scales.tables("scales", 3, self.version)
    }

    /// What the bytes of `sh0` mean, by channel: colours, and logits of opacity.
    pub(super) fn sh0_tables(&self) -> Result<Vec<Vec<f32>>, Unreadable> {
        if self.version == 1 {
            return self.sh0.tables("sh0", 4, 1);
        }
        let mut tables = self.sh0.tables("sh0", 3, self.version)?;
        tables.push((0..=255).map(logit_of_byte).collect());
        Ok(tables)
    }

    /// Names of all images.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        let of_all = self.means.files.iter().chain(&self.quats.files).chain(&self.scales.files).chain(&self.sh0.files);
        of_all.chain(self.others.iter().flat_map(|others| &others.files)).map(String::as_str)
    }

    /// Where the file's numbers lie in the scene, if it says so.
    pub(super) fn frame(&self) -> Option<Frame> {
        Frame::of_numbers(self.asset.as_ref()?.frame?)
    }

    pub(super) fn degree(&self) -> Degree {
        self.others.as_ref().and_then(|others| Degree::ALL.get(others.bands).copied()).unwrap_or_default()
    }
}

/// Gives a `meta.json` of version 1 the fields of version 2, but for tables, which [`Coded`] has in both.
fn to_second_version(value: &mut serde_json::Value) -> Result<(), Unreadable> {
    let incomplete = || {
        Unreadable::new(
            "has a meta.json that cannot be read: it says neither a version nor the shape of its centres, as version 1 does",
        )
    };
    let count = value.pointer("/means/shape/0").and_then(serde_json::Value::as_u64).ok_or_else(incomplete)?;
    value["version"] = 1.into();
    value["count"] = count.into();
    if let Some(others) = value.get("shN").filter(|others| !others.is_null()) {
        let others: FirstHarmonics = serde_json::from_value(others.clone())
            .map_err(|error| Unreadable::new(format!("has a meta.json that cannot be read: shN: {error}")))?;
        let bands = others.shape.get(1).and_then(|&n_rest| Degree::with_coefficients(n_rest + 1));
        value["shN"] = serde_json::json!({
            // As many as the image holds.
            "count": 0,
            "bands": bands.ok_or_else(incomplete)?.number(),
            "codebook": line(others.mins, others.maxs),
            "files": others.files,
        });
    }
    Ok(())
}

//! What the tiers of a bundle take of a level.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use pocketsplat_format::Bundle;
use pocketsplat_instructions::level::{Bound, Level, Need, Profile};
use serde::{Serialize, Serializer};

/// A bundle against a level.
#[derive(Serialize)]
pub(super) struct LevelFit {
    bundle: PathBuf,
    bundle_bytes: usize,
    profile: String,
    level: u8,
    level_frame_px: [u16; 2],
    tiers: Vec<TierFit>,
}

/// The scene up to a tier.
#[derive(Serialize)]
struct TierFit {
    tier: u8,
    n_anchors: u32,
    /// None where the manifest was not measured.
    psnr_db: Option<f32>,
    fits: bool,
    #[serde(serialize_with = "by_name")]
    bounds: [Need; 7],
}

impl LevelFit {
    /// What each tier in the file takes of level number `number`.
    pub(super) fn of(path: &Path, n_bytes: usize, bundle: &Bundle<'_>, number: u8) -> Result<Self> {
        let Some(level) = Level::numbered(number) else { bail!("there is no level {number}") };
        let tier = |tier: u8| {
            let Some(needs) = level.needs(bundle, tier) else {
                bail!("the bundle is not measured, so nobody knows what its frames take; train it anew");
            };
            Ok(TierFit {
                tier,
                n_anchors: bundle.tier(tier).map_or(0, |tier| tier.n_anchors),
                psnr_db: bundle.measures(tier).and_then(|measures| measures.psnr_db),
                fits: needs.iter().all(Need::is_kept),
                bounds: needs,
            })
        };
        Ok(Self {
            bundle: path.to_owned(),
            bundle_bytes: n_bytes,
            profile: Profile::of(&bundle.header().features).to_string(),
            level: number,
            level_frame_px: level.frame_px,
            tiers: (0..bundle.n_tiers()).map(tier).collect::<Result<_>>()?,
        })
    }

    /// A line a tier: that it fits and what it takes most of, or what is over and by how much.
    pub(super) fn table(&self) -> String {
        let Self { bundle, bundle_bytes, profile, level, level_frame_px: [width, height], tiers } = self;
        let mut text = format!(
            "{}: {bundle_bytes} bytes, profile {profile}; level {level}, frames of up to {width}x{height} px\n\n{:<8}{:>9}{:>8}  fits\n",
            bundle.display(),
            "tiers",
            "anchors",
            "PSNR",
        );
        for TierFit { tier, n_anchors, psnr_db, fits, bounds } in tiers {
            let psnr = psnr_db.map_or_else(|| "-".to_owned(), |psnr| format!("{psnr:.2}"));
            text += &format!("{:<8}{n_anchors:>9}{psnr:>8}  ", format!("0..={tier}"));
            // Frames of just that size say nothing about the room that is left.
            let others = bounds.iter().filter(|need| need.bound != Bound::Frame);
            let fullest = others.max_by(|a, b| a.share().total_cmp(&b.share()));
            text += &match fullest {
                Some(fullest) if *fits => format!("yes, {fullest}\n"),
                _ => {
                    let over: Vec<_> = bounds.iter().filter(|need| !need.is_kept()).map(ToString::to_string).collect();
                    format!("no: {}\n", over.join("; "))
                }
            };
        }
        text
    }
}

/// What is needed and allowed of each bound, by its name.
fn by_name<S: Serializer>(needs: &[Need; 7], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    let named = |need: &Need| (need.bound.name(), BTreeMap::from([("needed", need.needed), ("allowed", need.most)]));
    serializer.collect_map(needs.iter().map(named))
}

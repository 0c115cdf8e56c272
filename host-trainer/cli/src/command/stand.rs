//! Where to look at splats from, which came without cameras.

use std::path::Path;

use anyhow::{Context, Result, bail};
use pocketsplat_trainer::explicit::bulk::{Bulk, STRAY_RADII};
use pocketsplat_trainer::explicit::side::Evidence;
use pocketsplat_trainer::explicit::up::Up;
use pocketsplat_trainer::explicit::views::{Side, Stand};

use super::gaussians::GaussiansFile;
use crate::config::heading::INPUT;
use crate::say::say;

/// A larger share of Gaussians apart from the bulk is worth a warning: they may cost a dB, since a bundle has to show them too.
const MANY_APART: f64 = 0.01;

/// Options that say what splats do not.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub(crate) struct StandArgs {
    /// Axis that points up in the frame of the splats: one of +x, -x, +y, -y, +z, -z [default: what the file says, else -y]
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, help_heading = INPUT)]
    up: Option<Up>,
    /// Look at the splats from around them, as at an object [default: by how much is seen from inside alone]
    #[arg(long, conflicts_with = "inside", help_heading = INPUT)]
    around: bool,
    /// Look at the splats from their inside, as in a room [default: by how much is seen from inside alone]
    #[arg(long, help_heading = INPUT)]
    inside: bool,
}

impl StandArgs {
    /// Fails where one of them is given.
    ///
    /// * `why`: what says it already.
    pub(crate) fn refuse(&self, why: &str) -> Result<()> {
        if *self != Self::default() {
            bail!("--up, --around and --inside are for splats without cameras; {why}");
        }
        Ok(())
    }

    /// Where cameras of a file's splats stand; says on stderr what was assumed and which option says otherwise.
    pub(crate) fn stand(&self, path: &Path, file: &GaussiansFile) -> Result<Stand> {
        let bulk = bulk_of(path, file)?;
        let (up, why) = self.up(path, file);
        let evidence = Evidence::of(&file.gaussians, file.compensation(), &bulk, up);
        let (side, other) = match (self.around, self.inside) {
            (true, _) => (Side::Around, None),
            (_, true) => (Side::Inside, None),
            _ => match evidence.side() {
                Side::Around => (Side::Around, Some("--inside")),
                Side::Inside => (Side::Inside, Some("--around")),
            },
        };
        let place = match side {
            Side::Around if evidence.has_ground() => "around it and above its ground",
            Side::Around => "around it on all sides",
            Side::Inside => "inside of it",
        };
        say!("up is {up}, {why}");
        let otherwise = other.map_or_else(String::new, |other| {
            let content = 100.0 * evidence.content.max(0.0);
            let hollow =
                if evidence.could_be_either() { "; it is hollow and could be seen from either side" } else { "" };
            format!(", as {content:.0} % of it is seen from inside alone{hollow}; {other} says otherwise")
        });
        let warning = if other.is_some() && evidence.could_be_either() { "warning: " } else { "" };
        say!("{warning}bulk at {:.3}, radius {:.3}: cameras stand {place}{otherwise}", bulk.centre, bulk.radius);
        Ok(Stand { above_ground: evidence.has_ground(), front: evidence.front, bulk, up, side })
    }

    fn up(&self, path: &Path, file: &GaussiansFile) -> (Up, &'static str) {
        if let Some(up) = self.up {
            return (up, "as --up says");
        }
        if let Some(up) = file.up() {
            return (up, "as a comment of the file says; --up says otherwise");
        }
        let is_spz = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("spz"));
        let why = if is_spz {
            "which is y up in the axes of a .spz; --up says otherwise"
        } else {
            "as in COLMAP's axes, since the file does not say; --up says otherwise, as --up +z for Blender's"
        };
        (Up::MINUS_Y, why)
    }
}

/// The bulk of a file's splats; counts on stderr what lies apart from it.
pub(crate) fn bulk_of(path: &Path, file: &GaussiansFile) -> Result<Bulk> {
    let bulk = Bulk::of(&file.gaussians).with_context(|| {
        format!("nothing in {} can be looked at: no Gaussian is opaque, or all are in one point", path.display())
    })?;
    if bulk.n_apart > 0 {
        let strays = match bulk.n_strays {
            0 => String::new(),
            n => format!("; {n} of them are strays of more than {STRAY_RADII} radii, at which no anchor begins"),
        };
        let is_much = bulk.n_strays > 0 || bulk.n_apart as f64 > MANY_APART * file.gaussians.len() as f64;
        let warning = if is_much { "warning: " } else { "" };
        say!(
            "{warning}{} of {} Gaussians lie apart from the bulk, up to {:.3e} radii out: they are drawn, but decide nothing{strays}",
            bulk.n_apart,
            file.gaussians.len(),
            bulk.farthest / bulk.radius
        );
    }
    Ok(bulk)
}

//! A page of pictures all around splats, which needs no training and no WebAssembly.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context, Result};
use pocketsplat_trainer::explicit::views::{Side, Stand};
use pocketsplat_viewer::{base64, escaped};
use rayon::prelude::*;

use super::super::gaussians::{AxesArgs, GaussiansFile};
use super::super::stand::StandArgs;

const PAGE: &str = include_str!("splats.html");

/// Pictures of a turn: one for every 10 degrees.
const N_PICTURES: u16 = 36;
/// Width and height of each, px.
const SIDE_PX: u32 = 480;

/// The page of the splats in the file at `path`.
pub(super) fn page(path: &Path, axes: AxesArgs, stand: &StandArgs) -> Result<String> {
    let file = GaussiansFile::read(path, axes)?;
    let stand = stand.stand(path, &file)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let text = PAGE
        .replace("{{N}}", &N_PICTURES.to_string())
        .replace("{{LAST}}", &(N_PICTURES - 1).to_string())
        .replace("{{TOWARDS}}", if stand.side == Side::Around { "-1" } else { "1" })
        .replace("{{SIDE}}", &SIDE_PX.to_string())
        .replace("{{FACTS}}", &facts(&file, &stand))
        .replace("{{PICTURES}}", &pictures(&file, &stand)?);
    // Last, since it is the user's.
    Ok(text.replace("{{TITLE}}", &escaped(&name)))
}

fn pictures(file: &GaussiansFile, stand: &Stand) -> Result<String> {
    let normalisation = Stand::normalisation(&stand.bulk);
    let renderer = file.renderer_of_numbers(&normalisation);
    let picture = |i: u16| {
        let camera = stand.turned(TAU * f64::from(i) / f64::from(N_PICTURES), [SIDE_PX; 2]);
        let image = renderer.image(&normalisation.camera(&camera), [0.0; 3]);
        let bytes = image.to_jpeg().context("could not encode a picture")?;
        let hidden = if i == 0 { "" } else { " hidden" };
        Ok(format!("<img src=\"data:image/jpeg;base64,{}\" alt=\"\"{hidden}>", base64(&bytes)))
    };
    let pictures: Vec<String> = (0..N_PICTURES).into_par_iter().map(picture).collect::<Result<_>>()?;
    Ok(pictures.join("\n"))
}

fn facts(file: &GaussiansFile, stand: &Stand) -> String {
    let bulk = &stand.bulk;
    let from = match stand.side {
        Side::Around => "around",
        Side::Inside => "inside",
    };
    let [x, y, z] = bulk.centre.to_array();
    let mut rows = vec![
        ("Gaussians", file.gaussians.len().to_string()),
        ("Bytes", file.n_bytes.to_string()),
        ("Spherical harmonics", format!("degree {}", file.gaussians.degree.number())),
        ("Middle", format!("{x:.4}, {y:.4}, {z:.4}")),
        ("Radius", format!("{:.4}", bulk.radius)),
        ("Apart from the bulk", bulk.n_apart.to_string()),
        ("Up", stand.up.to_string()),
        ("Seen from", from.to_owned()),
    ];
    if file.compensation() {
        rows.push(("Opacities", "compensated for the dilation".to_owned()));
    }
    rows.iter()
        .map(|(name, value)| format!("<tr><th scope=\"row\">{name}</th><td>{}</td></tr>\n", escaped(value)))
        .collect()
}

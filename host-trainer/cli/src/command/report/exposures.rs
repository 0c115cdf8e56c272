//! How the photographs of a run were exposed, where they turned out to differ.

use anyhow::Result;

use super::super::train::result::ViewExposure;
use super::sections::table;
use crate::plot::exposures_svg;

/// A curve and a table; nothing where the photographs were taken for alike.
pub(super) fn section(exposures: Option<&[ViewExposure]>) -> Result<String> {
    let Some(exposures) = exposures else { return Ok(String::new()) };
    let stops: Vec<[f64; 3]> = exposures.iter().map(|exposure| exposure.stops).collect();
    let row = |exposure: &ViewExposure| {
        [vec![exposure.view.clone()], exposure.stops.iter().map(|stops| format!("{stops:+.2}")).collect()].concat()
    };
    Ok(format!(
        "<p>The photographs were exposed unlike each other. Each was compared under an exposure of its own; the bundle shows their mean.</p>\n\
         <div class=\"figure\" role=\"img\" aria-label=\"Exposure of each photograph\">{}</div>\n\
         <details><summary>{} photographs</summary>\n{}\n</details>",
        exposures_svg(&stops)?,
        exposures.len(),
        table("Exposure of each photograph", &["photograph", "red, stops", "green", "blue"], exposures.iter().map(row))
    ))
}

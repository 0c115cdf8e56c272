//! The best, the median and the worst view: photograph against picture.

use anyhow::{Context, Result};
use image::ImageEncoder as _;
use image::codecs::webp::WebPEncoder;
use pocketsplat_capture::dataset::Image;
use pocketsplat_codec::render::decoder::core_image;
use pocketsplat_format::Bundle;
use pocketsplat_viewer::{base64, escaped};

use super::{Photographs, Run};

/// Longer side of a picture at most: six of them are on the page.
const LONGER_SIDE_PX: u32 = 400;

/// The views by their PSNR: the best, the one in the middle, the worst; fewer where there are fewer.
fn chosen(photographs: &Photographs<'_>) -> Vec<(&'static str, usize)> {
    let views = &photographs.evaluation.views;
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.sort_by(|a, b| views[*b].psnr_db.total_cmp(&views[*a].psnr_db));
    let mut chosen: Vec<(&str, usize)> = Vec::new();
    for (label, place) in [("best", 0), ("median", order.len() / 2), ("worst", order.len().saturating_sub(1))] {
        if let Some(index) = order.get(place)
            && chosen.iter().all(|(_, other)| other != index)
        {
            chosen.push((label, *index));
        }
    }
    chosen
}

pub(super) fn section(run: &Run<'_>, bundle: &Bundle<'_>) -> Result<String> {
    let Some(photographs) = &run.photographs else {
        return Ok("<p>No photographs were held out of training, or they are not at hand.</p>".to_owned());
    };
    let (mut choices, mut pairs) = (String::new(), String::new());
    for (i, (label, index)) in chosen(photographs).into_iter().enumerate() {
        let (view, figures) = (&photographs.capture.test[index], &photographs.evaluation.views[index]);
        let drawn = core_image(bundle, &run.file.camera(bundle, photographs.capture, view))?.image;
        let (name, psnr_db) = (escaped(&view.name), figures.psnr_db);
        let checked = if i == 0 { " checked" } else { "" };
        choices += &format!(
            "<label class=\"choice\"><input type=\"radio\" name=\"pair\" value=\"{i}\"{checked}><span><b>{label}</b> {psnr_db:.2} dB</span></label>\n"
        );
        let [photograph, picture] = [&view.photograph()?.image, &drawn].map(data_uri);
        let hidden = if i == 0 { "" } else { " hidden" };
        pairs += &format!(
            "<div class=\"pair\" data-pair=\"{i}\"{hidden}>\n\
             <figure class=\"split\"><img src=\"{}\" alt=\"photograph {name}\"><img src=\"{}\" alt=\"picture {name}\" class=\"over\">\
             <input type=\"range\" min=\"0\" max=\"1000\" value=\"500\" aria-label=\"how much of the photograph is shown\">\
             <figcaption>photograph | picture of {name}</figcaption></figure>\n\
             <figure><canvas role=\"img\" aria-label=\"error of {name}\"></canvas><figcaption>error</figcaption></figure>\n</div>\n",
            photograph?, picture?
        );
    }
    Ok(format!("<div class=\"choices\" role=\"group\" aria-label=\"View\">\n{choices}</div>\n{pairs}"))
}

/// Lossless WebP: every pixel as it was measured, unless it had to be reduced.
fn data_uri(image: &Image) -> Result<String> {
    let longer = image.width_px.max(image.height_px);
    let side = |px: u32| if longer > LONGER_SIDE_PX { (px * LONGER_SIDE_PX / longer).max(1) } else { px };
    let small = image.area_resized(side(image.width_px), side(image.height_px));
    let mut bytes = Vec::new();
    WebPEncoder::new_lossless(&mut bytes)
        .write_image(&small.rgb, small.width_px, small.height_px, image::ExtendedColorType::Rgb8)
        .context("could not encode a picture")?;
    Ok(format!("data:image/webp;base64,{}", base64(&bytes)))
}

//! What a trained bundle takes of the limits that it was trained for.

use anyhow::Result;
use pocketsplat_trainer::device::Limits;
use pocketsplat_trainer::encode::{Cut, Fitted};

use crate::command::bundle::BundleFile;
use crate::say::say;

/// Says on stderr what the bundle takes of its limits, and what it lost to them.
pub(super) fn say(file: &BundleFile, limits: &Limits, fitted: &Fitted) -> Result<()> {
    let share = |taken: u64, most: u64| format!("{:.1} %", 100.0 * taken as f64 / most as f64);
    if let Some(most) = limits.flash_bytes {
        let len = file.bytes.len() as u64;
        say!("the bundle takes {len} of {most} bytes ({})", share(len, most));
    }
    if let (Some(most), Some(plan)) = (limits.ram_bytes, &fitted.plan) {
        let (len, strips) = (plan.least_len() as u64, plan.n_strips());
        let plural = if strips == 1 { "" } else { "s" };
        let share = share(len, most);
        say!(
            "the whole scene is drawn in {len} of {most} bytes ({share}) of scratch memory, in {strips} strip{plural}"
        );
    }
    if let (Some(processor), Some(instructions)) = (limits.processor, fitted.instructions) {
        let most = processor.frame_instructions();
        let [frame, frames] = [instructions, most].map(|n| n as f64 / 1e6);
        say!(
            "a frame takes {frame:.1} of {frames:.0} million instructions ({}), as predicted",
            share(instructions, most)
        );
        if instructions > most {
            say!(
                "warning: that is too many, and even half of the anchors would take more; train at a smaller --resolution, or \
                 draw with Quality::BALANCED"
            );
        }
    }
    let Some(Cut { n_anchors, flash_bytes, ram_bytes, instructions, psnr_db }) = fitted.cut else { return Ok(()) };
    let bundle = file.parse()?;
    let now = bundle.n_tiers().checked_sub(1).and_then(|tier| bundle.measures(tier)?.psnr_db);
    let lost =
        psnr_db.zip(now).map(|(before, now)| format!(" at a cost of {:.2} dB", before - now)).unwrap_or_default();
    let with_them = [
        Some(format!("{flash_bytes} bytes of flash")),
        ram_bytes.map(|bytes| format!("{bytes} bytes of scratch memory")),
        instructions.map(|n| format!("{:.1} million instructions a frame", n as f64 / 1e6)),
    ];
    let with_them = with_them.into_iter().flatten().collect::<Vec<_>>().join(", ");
    say!("the {n_anchors} least important anchors were left out to fit{lost}; with them the bundle takes {with_them}");
    Ok(())
}

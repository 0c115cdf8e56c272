//! What a device has that a bundle is made for, as options of `train` and `import` say it.

use anyhow::{Result, bail};
use bytesize::ByteSize;
use pocketsplat_capture::dataset::FrameSize;
use pocketsplat_instructions::level::{Bound, Level};
use pocketsplat_trainer::device::{Limits, ModelChoice, choose};

use super::settings::QualityOptions;
use crate::config::RunConfig;
use crate::config::heading::DEVICE;
use crate::config::named::level_number;
use crate::config::target::{BoardOrCore, board_or_core};
use crate::say::say;

/// Decoders for devices count bytes in 32 bits.
const MOST_BYTES: u64 = u32::MAX as u64;

/// What the device has that the bundle is for; what else the command line leaves open is chosen by it.
#[derive(clap::Args)]
pub(crate) struct DeviceArgs {
    /// Device class 1 (64 KiB) to 5 (8 MiB): sets --ram, --flash and --resolution, which may ask for less, and up to level 4 the
    /// processor [default: none]
    #[arg(long, value_name = "N", value_parser = level_number(), help_heading = DEVICE)]
    level: Option<u8>,
    /// Scratch bytes of the decoder, as 192KiB, excluding stack and frame buffer; the whole scene is guaranteed to fit
    /// [default: no limit]
    #[arg(long, value_name = "BYTES", help_heading = DEVICE)]
    ram: Option<ByteSize>,
    /// Size of the bundle, as 300kB or 1MiB; the scene is trained to fill it [default: no limit]
    #[arg(long, visible_alias = "bytes", value_name = "BYTES", help_heading = DEVICE)]
    flash: Option<ByteSize>,
    /// Board, which sets --ram, --flash, --resolution and the instructions of a frame at most, where these do not say otherwise; or a
    /// kind of processor, which limits the instructions alone [default: no limit]
    #[arg(long, value_name = "NAME", value_parser = board_or_core(), help_heading = DEVICE)]
    target: Option<BoardOrCore>,
}

impl DeviceArgs {
    /// The limits asked for: those of the level, where the other options do not ask for less.
    pub(super) fn limits(&self) -> Result<Limits> {
        let [ram_bytes, flash_bytes] = [self.ram, self.flash].map(|bytes| bytes.map(|bytes| bytes.as_u64()));
        for (option, given) in [("--ram", ram_bytes), ("--flash", flash_bytes)] {
            if let Some(given) = given.filter(|given| *given > MOST_BYTES) {
                bail!("{option} asks for {given} bytes, needed: at most {MOST_BYTES}; leave it out for no limit");
            }
        }
        let board = self.target.and_then(BoardOrCore::board);
        let given = Limits {
            ram_bytes: ram_bytes.or(board.map(|board| board.ram_bytes)),
            flash_bytes: flash_bytes.or(board.map(|board| board.flash_bytes)),
            processor: self.target.map(BoardOrCore::processor),
            level: None,
        };
        let Some(level) = self.level.and_then(Level::numbered) else { return Ok(given) };
        self.refuse_board_beside(level.number)?;
        let of_level = Limits::of_level(level);
        for (option, given, bound) in [("--ram", ram_bytes, Bound::Scratch), ("--flash", flash_bytes, Bound::Flash)] {
            refuse_more(level, option, given, bound)?;
        }
        if let (Some(given), Some(needed)) = (given.processor, of_level.processor)
            && given != needed
        {
            bail!(
                "--target contradicts --level {}, which has a target of its own; leave one of them out",
                level.number
            );
        }
        Ok(Limits {
            ram_bytes: ram_bytes.or(of_level.ram_bytes),
            flash_bytes: flash_bytes.or(of_level.flash_bytes),
            processor: given.processor.or(of_level.processor),
            ..of_level
        })
    }

    /// The frame to train for: the one given, or that of the board or level.
    ///
    /// * `is_sized`: whether another option says how large images are.
    pub(crate) fn frame(&self, given: Option<FrameSize>, is_sized: bool) -> Result<Option<FrameSize>> {
        let sized = |frame_px: [u16; 2]| given.or((!is_sized).then(|| frame_px.into()));
        if let Some(board) = self.target.and_then(BoardOrCore::board) {
            return Ok(sized(board.frame_px));
        }
        let Some(level) = self.level.and_then(Level::numbered) else { return Ok(given) };
        let pixels = given.map(|FrameSize { width_px, height_px }| u64::from(width_px) * u64::from(height_px));
        refuse_more(level, "--resolution", pixels, Bound::Frame)?;
        Ok(sized(level.frame_px))
    }

    /// Refuses a board where a level has set the limits: of the command line, or of a configuration.
    pub(super) fn refuse_board_beside(&self, level: u8) -> Result<()> {
        match self.target.and_then(BoardOrCore::board) {
            None => Ok(()),
            Some(board) => bail!("--target {} sets what level {level} sets too; leave one of them out", board.name),
        }
    }

    /// The options, and whether each is given.
    pub(super) fn given(&self) -> [(&'static str, bool); 4] {
        let Self { level, ram, flash, target } = self;
        [
            ("--level", level.is_some()),
            ("--ram", ram.is_some()),
            ("--flash", flash.is_some()),
            ("--target", target.is_some()),
        ]
    }

    /// Sets the limits, and what they afford where the options leave it open; nothing without limits.
    pub(crate) fn choose(&self, quality: &QualityOptions, lambda: Option<f64>, config: &mut RunConfig) -> Result<()> {
        let limits = self.limits()?;
        if limits.is_none() {
            return Ok(());
        }
        config.encoding.limits = limits;
        if let (None, None, Some(bytes)) = (limits.ram_bytes, limits.processor, limits.flash_bytes) {
            quality.choose_width(&mut config.train, bytes)?;
            let width = config.train.shape.feature_dim;
            match config.train.modules.rdo {
                Some(_) => say!(
                    "to fill this size: features of width {width}; the number of anchors and lambda are found while it trains"
                ),
                None => say!(
                    "warning: without rdo-pruning the scene is not trained to this size (features of width {width}); anchors \
                     that have no room are left out in the end"
                ),
            }
            return Ok(());
        }
        let choice = choose(&limits)?;
        quality.choose(&mut config.train, &choice);
        config.train.hac.lambda = lambda.unwrap_or(choice.lambda);
        let ModelChoice { feature_dim, n_offsets, max_anchors, lambda, binding } = choice;
        say!(
            "for this device: features of width {feature_dim}, {n_offsets} offsets, about {max_anchors} anchors (limited by \
             {binding}), lambda {lambda} at first; options override these"
        );
        Ok(())
    }
}

/// Refuses an option that allows more than the level does.
fn refuse_more(level: &Level, option: &str, given: Option<u64>, bound: Bound) -> Result<()> {
    let most = level.most(bound);
    if let Some(given) = given.filter(|given| *given > most) {
        bail!(
            "{option} asks for {given} {name}, and --level {} allows {most}; leave one of them out, or ask for less",
            level.number,
            name = bound.name()
        );
    }
    Ok(())
}

//! What `eval` says to people; `--json` says all of it.

use std::fmt;

use super::{Evaluation, TierEvaluation};

impl fmt::Display for Evaluation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { psnr_db, ssim, n_views, split, width_px, height_px, background, .. } = self;
        write!(f, "quality:  {psnr_db:.2} dB PSNR")?;
        if let Some(cc) = self.cc_psnr_db {
            write!(f, " ({cc:.2} colour-corrected)")?;
        }
        write!(f, ", {ssim:.4} SSIM")?;
        if let (Some(lpips), Some(of)) = (self.lpips, &self.lpips_of) {
            write!(f, ", {lpips:.4} LPIPS ({of})")?;
        }
        writeln!(f, "\nviews:    {n_views} of {split}, {width_px}×{height_px} px, background {background}")?;
        writeln!(
            f,
            "compare:  {:.2} dB PSNR of the photographs at half the size, enlarged again",
            self.half_size_copy_psnr_db
        )?;
        write!(f, "size:     {} bytes, {} Gaussians", self.bundle_bytes, self.n_gaussians)?;
        if self.n_anchors > 0 {
            write!(f, " of {} anchors", self.n_anchors)?;
        }
        write!(f, "\ntime:     {:.3} s to decode, {:.3} s to draw a view", self.decode_s, self.render_s_per_view)?;
        if self.scratch_bytes > 0 {
            write!(f, " in {} bytes of scratch memory", self.scratch_bytes)?;
        }
        writeln!(f, " (renderer: {})", self.renderer)?;
        if let Some(psnr_db) = self.psnr_to_reference_db {
            writeln!(f, "exact:    {psnr_db:.2} dB PSNR to the f64 reference, the lowest of the views")?;
        }
        for TierEvaluation { pruning_rate, psnr_db } in &self.tiers {
            writeln!(f, "tier:     {psnr_db:.2} dB PSNR without {:.0} % of the anchors", 100.0 * pruning_rate)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_come_in_words_and_units() {
        let evaluation = Evaluation {
            program: "0.1.0 r1".to_owned(),
            psnr_db: 32.041,
            cc_psnr_db: Some(33.2),
            ssim: 0.951_23,
            lpips: Some(0.0511),
            lpips_of: Some("VGG16, input in zero-to-one".to_owned()),
            half_size_copy_psnr_db: 28.0,
            bundle_bytes: 412_345,
            bundle_crc: Some(7),
            n_anchors: 8123,
            n_gaussians: 51_234,
            n_views: 25,
            split: "test".to_owned(),
            renderer: "core".to_owned(),
            width_px: 400,
            height_px: 300,
            background: "black".to_owned(),
            decode_s: 0.0421,
            render_s_per_view: 0.0313,
            scratch_bytes: 812_345,
            psnr_with_other_axes_db: None,
            psnr_to_reference_db: Some(58.3),
            tiers: vec![TierEvaluation { pruning_rate: 0.4, psnr_db: 29.1 }],
            protocol: None,
            views: Vec::new(),
        };
        assert_eq!(
            evaluation.to_string(),
            "quality:  32.04 dB PSNR (33.20 colour-corrected), 0.9512 SSIM, 0.0511 LPIPS (VGG16, input in zero-to-one)\n\
             views:    25 of test, 400×300 px, background black\n\
             compare:  28.00 dB PSNR of the photographs at half the size, enlarged again\n\
             size:     412345 bytes, 51234 Gaussians of 8123 anchors\n\
             time:     0.042 s to decode, 0.031 s to draw a view in 812345 bytes of scratch memory (renderer: core)\n\
             exact:    58.30 dB PSNR to the f64 reference, the lowest of the views\n\
             tier:     29.10 dB PSNR without 40 % of the anchors\n"
        );
    }
}

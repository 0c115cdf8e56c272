//! A scene as a file: fitted to what the format holds, then written.

use crate::{Format, Frame, Gaussians, Notes, Unreadable, fit, glb, ply, sog, spz};

/// A file as it is to be on disk.
#[derive(Debug)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// Which of the given Gaussians each of the file's is, in its order; some may be left out.
    pub sources: Vec<usize>,
    /// Where the file's numbers lie in the scene.
    pub frame: Frame,
    /// What the format does not hold of the scene, a sentence each.
    pub warnings: Vec<String>,
}

impl Format {
    /// The file of this format that holds the scene: in its own numbers where the format's steps and ranges do, else moved or in other
    /// units.
    ///
    /// * `notes`: its frame is that of `gaussians`.
    ///
    /// # Errors
    /// [`Unreadable`] for Gaussians that cannot be drawn, or that the format cannot hold in any frame.
    pub fn write(self, gaussians: &Gaussians, notes: &Notes) -> Result<Written, Unreadable> {
        gaussians.check()?;
        let fit::Fitted { gaussians, frame, sources, mut warnings } = fit::fitted(self, gaussians, &notes.frame)?;
        let notes = Notes { frame, ..notes.clone() };
        let (bytes, sources) = match self {
            Self::Ply => (ply::write(&gaussians, &notes), sources),
            Self::Glb => (glb::write(&gaussians, &notes)?, sources),
            Self::Spz => {
                warnings.extend(spz::clips(&gaussians));
                (spz::write(&gaussians, &notes)?, sources)
            }
            Self::Sog => {
                let order = sog::order(&gaussians.centres);
                (sog::write(&gaussians, &notes)?, order.into_iter().map(|index| sources[index]).collect())
            }
        };
        Ok(Written { bytes, sources, frame, warnings })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;
    use crate::tests::of_degree;

    /// 1,000 Gaussians of a twentieth of a unit's size, within two units.
    fn scene() -> Gaussians {
        let mut gaussians = of_degree(Degree::Zero, 1000);
        gaussians.log_scales.iter_mut().for_each(|scales| *scales = [-3.0, -3.5, -2.5]);
        gaussians
    }

    fn read(format: Format, bytes: &[u8]) -> (Gaussians, Notes) {
        match format {
            Format::Ply => ply::read(bytes),
            Format::Spz => spz::read(bytes, None),
            Format::Sog => sog::read(bytes),
            Format::Glb => glb::read(bytes),
        }
        .expect("ours")
    }

    /// Largest distance of a centre from where the scene has it, in its deviations, and largest difference of ln of deviations.
    fn errors(format: Format, scene: &Gaussians, frame: &Frame) -> ([f64; 2], Written) {
        let notes = Notes { frame: *frame, ..Notes::default() };
        let written = format.write(scene, &notes).expect("fits");
        let (back, notes) = read(format, &written.bytes);
        assert_eq!((notes.frame, back.len()), (written.frame, written.sources.len()), "{format:?}");
        let mut worst = [0.0f64; 2];
        for (index, &source) in written.sources.iter().enumerate() {
            let there = |g: &Gaussians, index: usize, f: &Frame, axis: usize| {
                f.offset[axis] + f.scale * f64::from(g.centres[index][axis])
            };
            for axis in 0..3 {
                let away = there(&back, index, &notes.frame, axis) - there(scene, source, frame, axis);
                let size = frame.scale * f64::from(scene.log_scales[source][1]).exp();
                worst[0] = worst[0].max(away.abs() / size);
                let ln = |g: &Gaussians, index: usize, f: &Frame| f64::from(g.log_scales[index][axis]) + f.scale.ln();
                worst[1] = worst[1].max((ln(&back, index, &notes.frame) - ln(scene, source, frame)).abs());
            }
        }
        (worst, written)
    }

    #[test]
    fn every_format_holds_a_scene_in_any_units_and_anywhere() {
        for format in Format::ALL {
            for offset in [[0.0; 3], [5.4e6, -2.1e6, 880.0]] {
                for scale in [1.0, 1e-4, 1e6] {
                    let frame = Frame { offset, scale };
                    let ([away, ln], written) = errors(format, &scene(), &frame);
                    assert!(away < 0.3 && ln < 0.05, "{format:?} {frame}: {away}, {ln}, as {}", written.frame);
                    assert_eq!(written.sources.len(), 1000);
                    assert_eq!(written.warnings.is_empty(), written.frame.is_identity(), "{:?}", written.warnings);
                }
            }
            let (_, written) = errors(format, &scene(), &Frame::default());
            assert!(written.frame.is_identity() && written.warnings.is_empty(), "{format:?}: {:?}", written.warnings);
        }
    }

    #[test]
    fn strays_do_not_govern_a_file() {
        for n_strays in [1, 100] {
            let mut gaussians = scene();
            for index in 0..n_strays {
                gaussians.centres[10 * index] = [1e6, -2e6 - index as f32, 0.0];
            }
            for format in Format::ALL {
                let ([away, ln], written) = errors(format, &gaussians, &Frame::default());
                assert!(ln < 0.05, "{format:?}");
                assert!(away < 0.3 || format == Format::Sog, "{format:?}: {away}");
                let n_left_out = if format == Format::Spz { n_strays } else { 0 };
                assert_eq!(written.sources.len(), 1000 - n_left_out, "{format:?}: {:?}", written.warnings);
                // A .sog keeps many strays, each as far from its place as it is far out.
                let is_said = n_left_out > 0 || format == Format::Sog && n_strays > 10;
                assert_eq!(written.warnings.len(), usize::from(is_said), "{format:?}: {:?}", written.warnings);
            }
        }
    }

    #[test]
    fn what_a_spz_cuts_is_counted_and_named() {
        let mut gaussians = of_degree(Degree::One, 100);
        gaussians.log_scales[3][2] = 7.5;
        gaussians.harmonics[0] = [0.0, 9.0, -3.4];
        gaussians.harmonics[5] = [-2.5, 0.0, 1.5];
        let said = Format::Spz.write(&gaussians, &Notes::default()).expect("fits").warnings;
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(
            said[0].starts_with("1 of 300 ln of deviations (0.33 %)") && said[0].contains("farthest at 7.5"),
            "{said:?}"
        );
        assert!(
            said[1].starts_with("2 of 300 numbers of constant colours") && said[1].contains("farthest at 9"),
            "{said:?}"
        );
        assert!(said[2].starts_with("2 of 900 harmonics") && said[2].contains("farthest at -2.5"), "{said:?}");
    }

    #[test]
    fn sizes_that_no_frame_holds_are_refused() {
        let mut gaussians = scene();
        for (index, scales) in gaussians.log_scales.iter_mut().enumerate() {
            *scales = [[-30.0, 0.0, 30.0][index % 3]; 3];
        }
        let error = Format::Spz.write(&gaussians, &Notes::default()).expect_err("too wide").to_string();
        assert!(error.contains("of its 1000 Gaussians") && error.ends_with("write a .ply"), "{error}");
    }
}

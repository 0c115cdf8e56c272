//! How the photographs of a bundle were prepared, as the bundle says it.

use std::fmt;

use anyhow::Result;
use pocketsplat_capture::dataset::{Background, Capture, LoadOptions};
use pocketsplat_codec::bundle::MAX_PROTOCOL_LEN;
use pocketsplat_format::bundle::crc32;
use serde::{Deserialize, Serialize};

use super::spread::spread;
use super::{CaptureOptions, Difference};
use crate::program;

/// Parts of a normalised unit, and of a rotation's entries, to which poses are rounded in a fingerprint.
const POSE_PARTS: f64 = 1e4;

/// What a bundle says about its photographs, so that whoever measures it prepares them alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Protocol {
    /// Version of the program that trained it, and its revision of training.
    pub(crate) program: String,
    /// The capture, as [`fingerprint`] gives it.
    capture: String,
    /// How far the training cameras stand to the left of the first one, to the right of it and ahead of it, normalised units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) spread: Option<[f64; 3]>,
    /// How it was loaded; split and background said even where they are the defaults.
    #[serde(flatten)]
    pub(crate) options: CaptureOptions,
}

impl Protocol {
    /// Of a run on a loaded capture.
    pub(crate) fn of(capture: &Capture, options: &CaptureOptions) -> Self {
        let program = program::training();
        let spread = spread(capture.train.iter().map(|view| &view.camera));
        Self { program, capture: fingerprint(capture), spread, options: Self::said(options) }
    }

    /// The options as a protocol says them: split and background too where they are the defaults, and not what decides where
    /// training starts and nothing of its photographs.
    pub(crate) fn said(options: &CaptureOptions) -> CaptureOptions {
        let said = options.or(&CaptureOptions {
            background: Some(Background::Black),
            test_every: Some(LoadOptions::default().test_every),
            ..CaptureOptions::default()
        });
        CaptureOptions { scene: None, points: None, n_random_points: None, ..said }
    }

    /// The folder of images whose name does not fit into the section of a bundle, if so.
    pub(crate) fn omitted_images(&self) -> Result<Option<&str>> {
        let fits = toml::to_string(&Self { spread: None, ..self.clone() })?.len() <= MAX_PROTOCOL_LEN;
        Ok(self.options.images.as_deref().filter(|_| !fits))
    }

    /// As the section of a bundle, without [`Self::omitted_images`], and without the cameras' spread where there is no room for both.
    pub(crate) fn to_text(&self) -> Result<String> {
        let images = self.options.images.clone().filter(|_| matches!(self.omitted_images(), Ok(None)));
        let options = CaptureOptions { images, ..self.options.clone() };
        let said = Self { options, ..self.clone() };
        let text = toml::to_string(&said)?;
        if text.len() <= MAX_PROTOCOL_LEN { Ok(text) } else { Ok(toml::to_string(&Self { spread: None, ..said })?) }
    }

    /// Reads the section; what other versions may have added is passed over.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        super::parse(text)
    }

    /// Where two differ besides the options: the capture, and the version of the program.
    pub(crate) fn differences(&self, other: &Self) -> Vec<Difference> {
        let pairs = [("capture", &self.capture, &other.capture), ("program", &self.program, &other.program)];
        let differing = pairs.into_iter().filter(|(_, one, other)| one != other);
        differing
            .map(|(key, one, other)| Difference { key: key.to_owned(), one: one.clone(), other: other.clone() })
            .collect()
    }

    /// Whether two are of one capture.
    pub(crate) fn shares_capture_with(&self, other: &Self) -> bool {
        self.capture == other.capture
    }

    /// Why a capture is not the one that the bundle was trained on.
    pub(crate) fn contradiction(&self, capture: &Capture) -> Option<String> {
        let found = fingerprint(capture);
        (found != self.capture).then(|| {
            format!(
                "this is another capture than the bundle was trained on, or other views of it (fingerprint {found}, the \
                 bundle's is {})",
                self.capture
            )
        })
    }
}

/// A checksum of the names and poses of all views, whatever their size and split.
fn fingerprint(capture: &Capture) -> String {
    let mut views: Vec<_> = capture.train.iter().chain(&capture.test).collect();
    views.sort_by(|a, b| a.name.cmp(&b.name));
    let mut bytes = Vec::new();
    for view in views {
        bytes.extend(view.name.bytes().chain([0]));
        let pose = view.camera.rotation.to_cols_array().into_iter().chain(view.camera.translation.to_array());
        #[expect(clippy::cast_possible_truncation, reason = "normalised units, far below 2³¹ parts")]
        bytes.extend(pose.flat_map(|x| ((x * POSE_PARTS).round() as i32).to_le_bytes()));
    }
    format!("{:08x}", crc32(&bytes))
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let CaptureOptions { max_resolution, resolution, background, images, model, test_every, .. } = &self.options;
        match (resolution, max_resolution) {
            (Some(frame), _) => write!(f, "images cut to {frame}")?,
            (None, Some(px)) => write!(f, "images of at most {px} px")?,
            (None, None) => f.write_str("images of full size")?,
        }
        if let Some(images) = images {
            write!(f, " of the folder {images}")?;
        }
        if let Some(model) = model {
            write!(f, ", sparse model {model}")?;
        }
        if let Some(background) = background {
            write!(f, ", background {background}")?;
        }
        match test_every {
            Some(0) => f.write_str(", no view held out")?,
            Some(every) => write!(f, ", one view in {every} held out where the capture has no split")?,
            None => {}
        }
        write!(f, "; trained by pocketsplat {}", self.program)
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_capture::dataset::FrameSize;

    use super::*;

    fn protocol(images: Option<&str>) -> Protocol {
        Protocol {
            program: "0.1.0".to_owned(),
            capture: "00ff12ab".to_owned(),
            spread: Some([10.25, 11.75, 22.25]),
            options: CaptureOptions {
                resolution: Some("160x120".parse::<FrameSize>().unwrap()),
                background: Some(Background::White),
                images: images.map(str::to_owned),
                model: Some(12),
                test_every: Some(10),
                ..CaptureOptions::default()
            },
        }
    }

    #[test]
    fn the_longest_section_comes_back() {
        let full = protocol(Some("images_of_the_second_day"));
        let text = full.to_text().unwrap();
        assert!(text.len() <= MAX_PROTOCOL_LEN, "{} bytes: {text}", text.len());
        assert_eq!(Protocol::parse(&text).unwrap(), full);
        let said = full.to_string();
        assert!(said.contains("cut to 160x120") && said.contains("one view in 10"), "{said}");
    }

    #[test]
    fn a_name_that_does_not_fit_is_left_out() {
        let long = protocol(Some(&"a".repeat(150)));
        let text = long.to_text().unwrap();
        assert!(text.len() <= MAX_PROTOCOL_LEN, "{} bytes: {text}", text.len());
        assert_eq!(Protocol::parse(&text).unwrap(), protocol(None));
        // Whoever measures needs the folder; the page only sways less.
        let longer = protocol(Some(&"a".repeat(50)));
        let parsed = Protocol::parse(&longer.to_text().unwrap()).unwrap();
        assert_eq!((parsed.options.images, parsed.spread), (longer.options.images, None));
        assert_eq!(long.omitted_images().unwrap(), Some("a".repeat(150).as_str()), "so that training can say it");
        assert_eq!(protocol(Some("images_2")).omitted_images().unwrap(), None);
    }

    #[test]
    fn later_versions_may_say_more() {
        let text = format!("{}exposure = true\n", protocol(None).to_text().unwrap());
        assert_eq!(Protocol::parse(&text).unwrap(), protocol(None));
        assert!(Protocol::parse("program = 3").is_err());
    }
}

//! Records of vendors: type, length and content, one behind the other. Two are known: Adobe's of the axes, and ours of the frame.

use super::AXES_OPTION;
use crate::Frame;
use crate::axes::{Signs, SpzAxes};

/// `SPZ_ADOBE_coordinate_system`: one number of 32 bits.
const AXES: u32 = 0xADBE_0003;
/// Ours: where the file's numbers lie in the scene, four numbers of 64 bits: offset and scale.
const FRAME: u32 = 0x7073_0001;
/// Type and length.
const HEAD_BYTES: usize = 8;

/// The names of the axes that a record may give, from 1 on: of x, y, z, the direction of each.
const NAMES: [&str; 16] =
    ["LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF", "LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU"];

#[derive(Default)]
pub(super) struct Records {
    /// The name of the axes.
    axes: Option<&'static str>,
    pub(super) frame: Option<Frame>,
    /// Names of the others.
    pub(super) unknown: Vec<String>,
}

/// How the axes of a file are taken.
pub(super) struct FoundAxes {
    pub(super) signs: Signs,
    /// `None` for yet other ones.
    pub(super) axes: Option<SpzAxes>,
    /// In a sentence, with the option that says otherwise.
    pub(super) said: String,
}

impl Records {
    /// Reads as many as are whole.
    pub(super) fn read(bytes: &[u8]) -> Self {
        let mut records = Self::default();
        let mut rest = bytes;
        while let Some((&head, after)) = rest.split_first_chunk::<HEAD_BYTES>() {
            let [t0, t1, t2, t3, l0, l1, l2, l3] = head;
            let (kind, length) = (u32::from_le_bytes([t0, t1, t2, t3]), u32::from_le_bytes([l0, l1, l2, l3]) as usize);
            let Some(content) = after.get(..length) else { break };
            rest = &after[length..];
            match kind {
                AXES => {
                    let number = content.first_chunk().map_or(0, |number| u32::from_le_bytes(*number)) as usize;
                    records.axes = number.checked_sub(1).and_then(|index| NAMES.get(index)).copied();
                }
                FRAME => records.frame = frame_of(content),
                _ => records.unknown.push(format!("extension 0x{kind:08X}")),
            }
        }
        records
    }

    /// What the axes are.
    ///
    /// * `given`: by the user, whatever the record says.
    pub(super) fn axes(&self, given: Option<SpzAxes>) -> FoundAxes {
        if let Some(axes) = given {
            return FoundAxes {
                signs: axes.signs(),
                axes: Some(axes),
                said: format!("its axes are taken {}, as {AXES_OPTION} says", words(axes)),
            };
        }
        let Some(name) = self.axes else {
            let (axes, other) = (SpzAxes::AsDescribed, SpzAxes::AsInPly);
            return FoundAxes {
                signs: axes.signs(),
                axes: Some(axes),
                said: format!(
                    "it does not say which axes it has: they are taken {}; `{AXES_OPTION} {}` of `export`, `import` and `eval` takes them {}",
                    words(axes),
                    other.name(),
                    words(other)
                ),
            };
        };
        let axes = match name {
            "RUB" => Some(SpzAxes::AsDescribed),
            "RDF" => Some(SpzAxes::AsInPly),
            _ => None,
        };
        let [x, y, z] = [0, 1, 2].map(|axis| name.as_bytes()[axis]);
        // Those whose z is up or down come out as x right, y forward, z up.
        let backward: [&[u8]; 3] = if matches!(z, b'U' | b'D') { [b"L", b"B", b"D"] } else { [b"L", b"U", b"B"] };
        let sign = |letter: u8, backward: &[u8]| if backward.contains(&letter) { -1.0 } else { 1.0 };
        FoundAxes {
            signs: Signs([sign(x, backward[0]), sign(y, backward[1]), sign(z, backward[2])]),
            axes,
            said: format!("its axes are {}, as its record says", spelled(name)),
        }
    }
}

fn words(axes: SpzAxes) -> &'static str {
    match axes {
        SpzAxes::AsDescribed => {
            "as the format's description has them (x right, y up, z back) and turned to those of a .ply"
        }
        SpzAxes::AsInPly => {
            "as those of the .ply that it was made of, as splat-transform 3, GaussForge and gsply write them"
        }
    }
}

/// x right, y up, z back.
fn spelled(name: &str) -> String {
    let word = |letter| match letter {
        'L' => "left",
        'R' => "right",
        'U' => "up",
        'D' => "down",
        'B' => "back",
        _ => "forward",
    };
    ["x", "y", "z"]
        .iter()
        .zip(name.chars())
        .map(|(axis, letter)| format!("{axis} {}", word(letter)))
        .collect::<Vec<_>>()
        .join(", ")
}

fn frame_of(content: &[u8]) -> Option<Frame> {
    let (numbers, _) = content.as_chunks::<8>();
    Frame::of_numbers(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect::<Vec<_>>().try_into().ok()?)
}

/// The records of a file with these axes and this frame.
pub(super) fn write(axes: SpzAxes, frame: &Frame) -> Vec<u8> {
    let name = match axes {
        SpzAxes::AsDescribed => "RUB",
        SpzAxes::AsInPly => "RDF",
    };
    let number = 1 + NAMES.iter().position(|other| *other == name).unwrap_or_default() as u32;
    let mut records = record(AXES, &number.to_le_bytes());
    if !frame.is_identity() {
        records.extend(record(FRAME, &frame.numbers().map(f64::to_le_bytes).concat()));
    }
    records
}

fn record(kind: u32, content: &[u8]) -> Vec<u8> {
    [&kind.to_le_bytes(), &(content.len() as u32).to_le_bytes(), content].concat()
}

#[cfg(test)]
mod tests {
    use super::{AXES, NAMES, Records, record, write};
    use crate::Frame;
    use crate::axes::{Signs, SpzAxes};

    #[test]
    fn what_is_written_is_read() {
        let frame = Frame { offset: [1.5, -2.0, 1e7], scale: 0.01 };
        for (axes, signs) in [(SpzAxes::AsDescribed, [1.0, -1.0, -1.0]), (SpzAxes::AsInPly, [1.0; 3])] {
            let records = Records::read(&write(axes, &frame));
            let found = records.axes(None);
            assert_eq!((found.axes, found.signs, records.frame), (Some(axes), Signs(signs), Some(frame)));
            assert!(found.said.ends_with("as its record says"), "{}", found.said);
            // What the user says is done.
            let other = records.axes(Some(axes.other()));
            assert_eq!((other.axes, other.signs), (Some(axes.other()), axes.other().signs()));
        }
    }

    #[test]
    fn other_axes_become_right_handed_ones() {
        let signs = |name: &str| {
            let number = 1 + NAMES.iter().position(|other| *other == name).expect("a name") as u32;
            let found = Records::read(&record(AXES, &number.to_le_bytes())).axes(None);
            (found.signs.0, found.axes)
        };
        assert_eq!(signs("LUF"), ([-1.0, -1.0, 1.0], None));
        assert_eq!(signs("RFU"), ([1.0, 1.0, 1.0], None));
        assert_eq!(signs("RBU"), ([1.0, -1.0, 1.0], None));
        assert_eq!(signs("LFD"), ([-1.0, 1.0, -1.0], None));
    }

    #[test]
    fn strange_records_are_passed_over() {
        let orbit = record(0xADBE_0002, &[0; 12]);
        let bytes = [orbit.as_slice(), &write(SpzAxes::AsInPly, &Frame::default()), &[1, 2, 3]].concat();
        let records = Records::read(&bytes);
        assert_eq!((records.unknown.len(), records.axes), (1, Some("RDF")));
        assert!(Records::read(&record(AXES, &99u32.to_le_bytes())).axes.is_none());
        assert!(Records::read(&[255; 64]).axes.is_none());
        let described = Records::default().axes(None);
        assert_eq!(described.axes, Some(SpzAxes::AsDescribed));
        assert!(described.said.contains("`--spz-axes as-in-ply`"), "{}", described.said);
    }
}

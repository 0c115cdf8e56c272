//! What COLMAP's words say about how far it is, in its versions.

/// How far COLMAP is within one of its programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) done: usize,
    /// How many there are, where the words say it.
    pub(super) of: Option<usize>,
}

/// The step that a line names, if it names one.
///
/// - Features: `Processed file [12/60]`.
/// - Matching: `Matching block [2/3, 1/3] in 9.9s`, `Matching image [7/60]`; `Processing` in the place of `Matching` from 3.12 on.
/// - The mapper: `Registering image #48 (12)`, or `(num_reg_frames=12)` from 3.12 on.
pub(super) fn step_in(line: &str) -> Option<Step> {
    if let Some((_, rest)) = line.split_once("Registering image #") {
        let inside = rest.split_once('(')?.1.split_once(')')?.0;
        let done = inside.rsplit('=').next()?.trim().parse().ok()?;
        return Some(Step { done, of: None });
    }
    let verbs =
        ["Processed file [", "Matching block [", "Matching image [", "Processing block [", "Processing image ["];
    let rest = verbs.iter().find_map(|verb| line.split_once(verb)).map(|(_, rest)| rest)?;
    let inside = rest.split_once(']')?.0;
    let pairs: Vec<(usize, usize)> = inside.split(',').map(share).collect::<Option<_>>()?;
    match pairs.as_slice() {
        [(i, n)] => Some(Step { done: *i, of: Some(*n) }),
        // Rows of blocks, and the blocks of a row.
        [(i, n), (j, m)] => Some(Step { done: (i - 1) * m + j, of: Some(n * m) }),
        _ => None,
    }
}

/// `3/7`, which counts from 1.
fn share(text: &str) -> Option<(usize, usize)> {
    let (i, n) = text.trim().split_once('/')?;
    let (i, n) = (i.parse().ok()?, n.parse().ok()?);
    (1..=n).contains(&i).then_some((i, n))
}

/// What COLMAP says is wrong, the last of it: what a person needs where it fails.
pub(super) fn fault_in(line: &str) -> Option<&str> {
    // Words of glog begin with E or F, date and time.
    let is_of_glog = |line: &str| line.len() > 9 && line.as_bytes()[0..9].iter().skip(1).all(u8::is_ascii_digit);
    let is_fault = (line.starts_with(['E', 'F']) && is_of_glog(line))
        || ["ERROR: ", "Check failed", "terminate called"].iter().any(|word| line.contains(word));
    is_fault.then(|| line.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_found_in_the_words_of_all_versions() {
        for (line, done, of) in [
            ("Processed file [12/60]", 12, Some(60)),
            ("I20240612 10:11:12.345678 140 feature_extraction.cc:258] Processed file [1/60]", 1, Some(60)),
            ("Matching block [2/3, 1/3] in 9.981s", 4, Some(9)),
            ("I20250101 feature_matching.cc:46] Processing block [3/3, 3/3]", 9, Some(9)),
            ("Matching image [7/60] in 0.310s", 7, Some(60)),
            ("I20250101 pairing.cc:1] Processing image [7/60]", 7, Some(60)),
            ("Matching block [2/5]", 2, Some(5)),
            ("Registering image #48 (3)", 3, None),
            ("I2025 incremental_pipeline.cc:413] Registering image #48 (num_reg_frames=31)", 31, None),
        ] {
            assert_eq!(step_in(line), Some(Step { done, of }), "{line}");
        }
        for line in
            ["", "  Features:        321", "Matching block [0/5]", "Matching block [1/x]", "Registering image #4"]
        {
            assert_eq!(step_in(line), None, "{line}");
        }
    }

    #[test]
    fn faults_are_told_from_other_words() {
        for line in [
            "ERROR: Failed to load image file",
            "F20240612 10:11:12.345678 140 sift.cc:1] Check failed: a == b",
            "E20240612 10:11:12.345678 140 image_reader.cc:7] Single camera specified",
            "Check failed: a.data()",
        ] {
            assert_eq!(fault_in(line), Some(line));
        }
        for line in ["Elapsed time: 0.044 [minutes]", "Features: 321", "WARNING: Your current options", "E"] {
            assert_eq!(fault_in(line), None, "{line}");
        }
    }
}

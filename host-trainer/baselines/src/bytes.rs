//! Numbers as bytes b between the least and the greatest: least + b·step.

use crate::baseline::Unreadable;
use crate::packed::Body;

/// N numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bytes {
    pub(crate) least: f32,
    pub(crate) step: f32,
    /// `[N]` b.
    pub(crate) bytes: Vec<u8>,
}

impl Bytes {
    /// The nearest of 256 numbers from the least to the greatest, moved by less than a step so that 0 is one of them where it lies between.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    pub(crate) fn of(values: &[f32]) -> Self {
        let least = values.iter().copied().fold(f32::INFINITY, f32::min);
        let greatest = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if values.is_empty() {
            return Self { least: 0.0, step: 1.0, bytes: Vec::new() };
        }
        let step = ((greatest - least) / 255.0).max(f32::MIN_POSITIVE);
        let least = if least < 0.0 && greatest > 0.0 { (least / step).round() * step } else { least };
        let bytes = values.iter().map(|value| ((value - least) / step).round() as u8).collect();
        Self { least, step, bytes }
    }

    pub(crate) fn value(&self, index: usize) -> f32 {
        self.least + f32::from(self.bytes[index]) * self.step
    }

    pub(crate) fn values(&self) -> Vec<f32> {
        (0..self.bytes.len()).map(|i| self.value(i)).collect()
    }
}

/// Appends the least and the step.
pub(crate) fn put_range(bytes: &Bytes, body: &mut Vec<u8>) {
    [bytes.least, bytes.step].iter().for_each(|number| body.extend(number.to_le_bytes()));
}

/// The least and the step.
///
/// # Errors
/// Numbers that are not finite, or that no byte could stand for.
pub(crate) fn range(body: &mut Body<'_>) -> Result<[f32; 2], Unreadable> {
    let [least, step] = [body.number("a range")?, body.number("a range")?];
    if !(least.is_finite() && step >= 0.0 && (least + 255.0 * step).is_finite()) {
        return Err(Unreadable(format!(
            "a range begins at {least} in steps of {step}, needed: finite numbers, steps of 0 or more; write the file again"
        )));
    }
    Ok([least, step])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_zero_and_are_half_a_step_off_at_most_between_the_ends() {
        let values = [-0.37, 0.0, 0.2, 1.0, 0.51];
        let found = Bytes::of(&values);
        assert!(found.value(1).abs() < 1e-7, "{}", found.value(1));
        for (i, value) in values.iter().enumerate() {
            assert!((found.value(i) - value).abs() < 1.01 * found.step, "{i}");
        }
        assert_eq!(Bytes::of(&[3.0, 3.0]).values(), [3.0, 3.0]);
        assert_eq!(Bytes::of(&[]).values(), [0.0; 0]);
    }
}

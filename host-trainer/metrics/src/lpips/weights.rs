//! The network of LPIPS-VGG as a safetensors file has it.

use std::path::Path;

use half::f16;
use safetensors::{Dtype, SafeTensors};

use super::conv::Conv3x3;
use super::{LpipsError, Stage};

/// What torchvision calls the convolutions of VGG16, `features.{number}`, by stage, with the channels they make.
const CONVOLUTIONS: [(&[usize], usize); 5] =
    [(&[0, 2], 64), (&[5, 7], 128), (&[10, 12, 14], 256), (&[17, 19, 21], 512), (&[24, 26, 28], 512)];

/// The stages that `bytes` hold; `path` is for messages.
///
/// # Errors
/// [`LpipsError`] naming the tensor that is missing, or has another shape, type or values than LPIPS-VGG's.
pub(super) fn stages(bytes: &[u8], path: &Path) -> Result<Vec<Stage>, LpipsError> {
    let tensors =
        SafeTensors::deserialize(bytes).map_err(|source| LpipsError::Malformed { path: path.to_owned(), source })?;
    let file = File { tensors, path };
    let mut n_in = 3;
    let mut stages = Vec::new();
    for (i, (numbers, n_out)) in CONVOLUTIONS.into_iter().enumerate() {
        let mut convolutions = Vec::new();
        for number in numbers {
            let weight = file.values(&format!("features.{number}.weight"), &[n_out, n_in, 3, 3], FINITE)?;
            let bias = file.values(&format!("features.{number}.bias"), &[n_out], FINITE)?;
            convolutions.push(Conv3x3::new(n_in, &weight, bias));
            n_in = n_out;
        }
        let head = file.values(&format!("lin{i}.weight"), &[1, n_out, 1, 1], NOT_NEGATIVE)?;
        stages.push(Stage { convolutions, head });
    }
    Ok(stages)
}

/// What the values of a tensor have to be, in words and as a test.
type Condition = (&'static str, fn(f32) -> bool);

const FINITE: Condition = ("a finite number", f32::is_finite);
/// The heads are trained under this bound; without it a difference could count as likeness.
const NOT_NEGATIVE: Condition = ("a finite number of at least 0", |value| value.is_finite() && value >= 0.0);

struct File<'a> {
    tensors: SafeTensors<'a>,
    path: &'a Path,
}

impl File<'_> {
    /// The values of the tensor `name`, widened.
    fn values(&self, name: &str, needed: &[usize], (condition, holds): Condition) -> Result<Vec<f32>, LpipsError> {
        let (path, name) = (|| self.path.to_owned(), || name.to_owned());
        let Ok(tensor) = self.tensors.tensor(&name()) else {
            return Err(LpipsError::Missing { path: path(), name: name(), needed: needed.to_vec() });
        };
        if tensor.shape() != needed {
            let (found, needed) = (tensor.shape().to_vec(), needed.to_vec());
            return Err(LpipsError::Shape { path: path(), name: name(), found, needed });
        }
        let bytes = tensor.data();
        let values: Vec<f32> = match tensor.dtype() {
            Dtype::F16 => bytes.as_chunks().0.iter().map(|&bytes| f16::from_le_bytes(bytes).to_f32()).collect(),
            Dtype::F32 => bytes.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect(),
            found => return Err(LpipsError::Type { path: path(), name: name(), found }),
        };
        match values.iter().position(|&value| !holds(value)) {
            None => Ok(values),
            Some(index) => {
                let found = values[index];
                Err(LpipsError::Value { path: path(), name: name(), index, found, needed: condition })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use safetensors::serialize;
    use safetensors::tensor::TensorView;

    use super::*;

    type Tensors = BTreeMap<String, (Dtype, Vec<usize>, Vec<u8>)>;

    /// A network of ones.
    fn sound() -> Tensors {
        let mut tensors = Tensors::new();
        let mut add = |name: String, shape: Vec<usize>| {
            let bytes = f16::ONE.to_le_bytes().repeat(shape.iter().product());
            tensors.insert(name, (Dtype::F16, shape, bytes));
        };
        let mut n_in = 3;
        for (i, (numbers, n_out)) in CONVOLUTIONS.into_iter().enumerate() {
            for number in numbers {
                add(format!("features.{number}.weight"), vec![n_out, n_in, 3, 3]);
                add(format!("features.{number}.bias"), vec![n_out]);
                n_in = n_out;
            }
            add(format!("lin{i}.weight"), vec![1, n_out, 1, 1]);
        }
        tensors
    }

    fn message_of(tensors: &Tensors) -> String {
        let views = tensors.iter().map(|(name, (dtype, shape, bytes))| {
            (name, TensorView::new(*dtype, shape.clone(), bytes).expect("a sound tensor"))
        });
        let bytes = serialize(views, None).expect("a sound file");
        stages(&bytes, Path::new("vgg.safetensors")).map_or_else(|error| error.to_string(), |_| "sound".to_owned())
    }

    #[test]
    fn every_fault_names_its_tensor() {
        let mut tensors = sound();
        assert_eq!(message_of(&tensors), "sound");
        let mut with = |name: &str, change: fn(&mut (Dtype, Vec<usize>, Vec<u8>)), parts: &[&str]| {
            let kept = tensors[name].clone();
            change(tensors.get_mut(name).expect("a tensor of this name"));
            let message = message_of(&tensors);
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
            tensors.insert(name.to_owned(), kept);
        };
        with(
            "features.7.bias",
            |tensor| (tensor.1, tensor.2) = (vec![64], vec![0; 128]),
            &["features.7.bias", "[64]", "[128]"],
        );
        with(
            "features.0.weight",
            |tensor| tensor.1 = vec![64, 27],
            &["features.0.weight", "[64, 27]", "[64, 3, 3, 3]"],
        );
        with("lin2.weight", |tensor| tensor.0 = Dtype::BF16, &["lin2.weight", "BF16", "F16 or F32"]);
        with(
            "lin3.weight",
            |tensor| tensor.2[2..4].copy_from_slice(&f16::NEG_ONE.to_le_bytes()),
            &["value 1", "lin3.weight", "-1"],
        );
        with(
            "features.28.bias",
            |tensor| tensor.2[..2].copy_from_slice(&f16::NAN.to_le_bytes()),
            &["features.28.bias", "NaN"],
        );
        tensors.remove("features.19.weight");
        let message = message_of(&tensors);
        assert!(message.contains("no tensor `features.19.weight` [512, 512, 3, 3]"), "{message}");
        let error = stages(b"GIF89a", Path::new("cat.gif")).expect_err("a picture");
        assert!(matches!(error, LpipsError::Malformed { .. }) && error.to_string().contains("cat.gif"), "{error}");
    }

    #[test]
    fn half_and_single_precision_are_read_alike() {
        let mut tensors = sound();
        for (dtype, _, bytes) in tensors.values_mut() {
            *dtype = Dtype::F32;
            *bytes = 1.0f32.to_le_bytes().repeat(bytes.len() / 2);
        }
        assert_eq!(message_of(&tensors), "sound");
    }
}

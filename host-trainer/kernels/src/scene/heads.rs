//! The anchor MLPs: opacity, covariance, colour, and the residual of detail.

use serde::{Deserialize, Serialize};

use super::ModelShape;

/// What an output row of each head means for offset k.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputLayout {
    /// K outputs: row k is the opacity logit, through tanh.
    Opacity,
    /// 7K outputs: rows 7k..7k+3 scale logits (sigmoid), 7k+3..7k+7 an unnormalised quaternion (w, x, y, z). Of isotropic
    /// Gaussians K outputs: row k the scale logit.
    Covariance,
    /// 3K outputs: rows 3k..3k+3 the colour logits (sigmoid).
    Colour,
}

impl OutputLayout {
    /// Inputs of the head.
    fn inputs(self, shape: &ModelShape) -> usize {
        match self {
            Self::Opacity | Self::Covariance => shape.geometry_inputs(),
            Self::Colour => shape.colour_inputs(),
        }
    }

    /// Outputs per offset.
    pub const fn per_offset(self, shape: &ModelShape) -> usize {
        match self {
            Self::Opacity => 1,
            Self::Covariance => shape.covariance_outputs(),
            Self::Colour => 3,
        }
    }
}

/// One head: `y = W2·relu(W1·x + b1) + b2`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Head<R> {
    /// Inputs.
    pub n_in: usize,
    /// Hidden units.
    pub n_hidden: usize,
    /// Outputs.
    pub n_out: usize,
    /// `[n_hidden, n_in]`, row-major.
    pub w1: Vec<R>,
    /// `[n_hidden]`.
    pub b1: Vec<R>,
    /// `[n_out, n_hidden]`, row-major.
    pub w2: Vec<R>,
    /// `[n_out]`.
    pub b2: Vec<R>,
}

impl<R: Copy> Head<R> {
    /// A head of the given widths with every parameter `value`.
    pub fn filled(n_in: usize, n_hidden: usize, n_out: usize, value: R) -> Self {
        Self {
            n_in,
            n_hidden,
            n_out,
            w1: vec![value; n_hidden * n_in],
            b1: vec![value; n_hidden],
            w2: vec![value; n_out * n_hidden],
            b2: vec![value; n_out],
        }
    }

    /// The parameter groups in file order: W1, b1, W2, b2.
    pub fn groups(&self) -> [&[R]; 4] {
        [&self.w1, &self.b1, &self.w2, &self.b2]
    }

    /// The parameter groups in file order, mutable.
    pub fn groups_mut(&mut self) -> [&mut Vec<R>; 4] {
        [&mut self.w1, &mut self.b1, &mut self.w2, &mut self.b2]
    }

    /// The same head with each parameter replaced by what `f` makes of it.
    pub fn map<T>(&self, f: impl Fn(R) -> T) -> Head<T> {
        let all = |values: &[R]| values.iter().map(|value| f(*value)).collect();
        let Self { n_in, n_hidden, n_out, w1, b1, w2, b2 } = self;
        Head { n_in: *n_in, n_hidden: *n_hidden, n_out: *n_out, w1: all(w1), b1: all(b1), w2: all(w2), b2: all(b2) }
    }

    /// Number of parameters.
    pub fn n_params(&self) -> usize {
        self.groups().iter().map(|g| g.len()).sum()
    }
}

/// The heads of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Heads<R> {
    /// [`OutputLayout::Opacity`].
    pub opacity: Head<R>,
    /// [`OutputLayout::Covariance`].
    pub covariance: Head<R>,
    /// [`OutputLayout::Colour`].
    pub colour: Head<R>,
    /// From `[feature F, colour 3]` of a Gaussian to what is added to its colour, where the shape has it: see
    /// [`crate::ops::heads::detail`].
    pub detail: Option<Head<R>>,
}

impl<R: Copy> Heads<R> {
    /// Heads for `shape` with every parameter `value`.
    pub fn filled(shape: &ModelShape, value: R) -> Self {
        let head = |layout: OutputLayout, n_hidden| {
            Head::filled(layout.inputs(shape), n_hidden, layout.per_offset(shape) * shape.n_offsets, value)
        };
        let detail = |n_hidden| Head::filled(shape.feature_dim + 3, n_hidden, 3, value);
        Self {
            opacity: head(OutputLayout::Opacity, shape.feature_dim),
            covariance: head(OutputLayout::Covariance, shape.feature_dim),
            colour: head(OutputLayout::Colour, shape.colour_width()),
            detail: (shape.detail_hidden > 0).then(|| detail(shape.detail_hidden)),
        }
    }
}

impl<R> Heads<R> {
    /// The heads in file order: opacity, covariance, colour, then detail if there is one.
    pub fn each(&self) -> impl Iterator<Item = &Head<R>> {
        [&self.opacity, &self.covariance, &self.colour].into_iter().chain(&self.detail)
    }

    /// Their names, in the same order.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + use<R> {
        ["opacity", "covariance", "colour"].into_iter().chain(self.detail.is_some().then_some("detail"))
    }

    /// The heads in file order, mutable.
    pub fn each_mut(&mut self) -> impl Iterator<Item = &mut Head<R>> {
        let first = [&mut self.opacity, &mut self.covariance, &mut self.colour];
        first.into_iter().chain(&mut self.detail)
    }

    /// The same heads with each replaced by what `f` makes of it.
    pub fn map<T>(&self, f: impl Fn(&Head<R>) -> Head<T>) -> Heads<T> {
        Heads {
            opacity: f(&self.opacity),
            covariance: f(&self.covariance),
            colour: f(&self.colour),
            detail: self.detail.as_ref().map(&f),
        }
    }
}

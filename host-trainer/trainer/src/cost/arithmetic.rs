//! The decoder's choices of arithmetic by name: types there, values here.

use pocketsplat_core::{Arithmetic, ReferenceArithmetic, WithoutFpu};

/// What a frame is computed with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ArithmeticChoice {
    /// That of `Decoder::bind`.
    #[default]
    Reference,
    /// What is cheaper without an FPU.
    WithoutFpu,
}

/// A function of an arithmetic.
pub trait WithArithmetic {
    /// What it returns.
    type Output;

    /// Calls it.
    fn call<A: Arithmetic>(self) -> Self::Output;
}

impl ArithmeticChoice {
    /// The name of the type that it stands for.
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Reference => "ReferenceArithmetic",
            Self::WithoutFpu => "WithoutFpu",
        }
    }

    /// Calls `with` for the type that it stands for.
    pub fn call<W: WithArithmetic>(self, with: W) -> W::Output {
        match self {
            Self::Reference => with.call::<ReferenceArithmetic>(),
            Self::WithoutFpu => with.call::<WithoutFpu>(),
        }
    }
}

//! The decoder's choices of arithmetic by name: types there, values here.

use pocketsplat_core::{Arithmetic, ReferenceArithmetic, WithoutFpu};
use pocketsplat_instructions::Processor;

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
    /// What firmware for a processor draws with, unless it asks for another.
    pub fn of(processor: Processor) -> Self {
        if processor.has_fpu() { Self::Reference } else { Self::WithoutFpu }
    }

    /// The same of several: that of the first if they agree, else that of `Decoder::bind`.
    pub fn of_all(processors: &[Processor]) -> Self {
        let mut all = processors.iter().map(|processor| Self::of(*processor));
        all.next().filter(|first| all.all(|other| other == *first)).unwrap_or_default()
    }

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

#[cfg(test)]
mod tests {
    use super::{ArithmeticChoice, Processor};

    #[test]
    fn processors_that_all_lack_an_fpu_draw_without_one() {
        use Processor::{CortexM0Plus, CortexM4, CortexM7, Riscv32imac, Riscv32imafc};
        assert_eq!(ArithmeticChoice::of_all(&[Riscv32imac, CortexM0Plus]), ArithmeticChoice::WithoutFpu);
        for others in [&[][..], &[CortexM4, Riscv32imafc], &[Riscv32imac, CortexM4], &[CortexM7, CortexM0Plus]] {
            assert_eq!(ArithmeticChoice::of_all(others), ArithmeticChoice::Reference, "{others:?}");
        }
    }
}

//! The decoder's choices of arithmetic by name: types there, values here.

use pocketsplat_core::arithmetic::{
    Arithmetic, F16, F32, I16, Reference, ReferenceArithmetic, Table, Wide, With, WithoutFpu,
};

/// Names each choice once, and calls a generic function for it.
macro_rules! choices {
    ($($choice:ident, $parameter:literal, $name:literal, $type:ty, $doc:literal;)*) => {
        /// What a frame is computed with.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub enum ArithmeticChoice {
            /// That of `Decoder::bind`.
            #[default]
            Reference,
            $(#[doc = $doc] $choice,)*
        }

        impl ArithmeticChoice {
            /// All but the reference.
            pub const TURNED: &[Self] = &[$(Self::$choice),*];

            /// The parameter that it varies, and to what.
            pub fn name(self) -> (&'static str, &'static str) {
                match self {
                    Self::Reference => ("arithmetic", "reference"),
                    $(Self::$choice => ($parameter, $name),)*
                }
            }

            /// Calls `with` for the type that it stands for.
            pub fn call<W: WithArithmetic>(self, with: W) -> W::Output {
                match self {
                    Self::Reference => with.call::<ReferenceArithmetic>(),
                    $(Self::$choice => with.call::<$type>(),)*
                }
            }
        }
    };
}

/// A function of an arithmetic.
pub trait WithArithmetic {
    /// What it returns.
    type Output;

    /// Calls it.
    fn call<A: Arithmetic>(self) -> Self::Output;
}

choices! {
    F16, "heads", "f16", With<F16>, "Weights of the heads as halves.";
    I16, "heads", "i16", With<I16>, "Heads in 16-bit integers.";
    Table, "functions", "table", With<F32, Table>, "Functions from a table.";
    Wide, "splats", "40 bytes", With<F32, Reference, Wide>, "Splats all in f32.";
    WithoutFpu, "together", "i16, table", WithoutFpu, "What is cheaper without an FPU.";
}

//! The decoder's choices of arithmetic by name: types there, values here.

use pocketsplat_core::arithmetic::{
    Arithmetic, Depth16, Depth32, Exact, F16, F32, Fast, I8, I16, Ieee, Libm, Mixed, Narrow, Polynomial, Precise,
    Quick, QuickWithoutFpu, Rgb565, Rgb565Dithered, StrictF16, Table, Wide, With,
};

/// Names each choice once, and calls a generic function for it.
macro_rules! choices {
    ($($choice:ident, $knob:literal, $name:literal, $type:ty, $doc:literal;)*) => {
        /// What a frame is computed with.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub enum Choice {
            /// As the reference.
            #[default]
            Exact,
            $(#[doc = $doc] $choice,)*
        }

        impl Choice {
            /// All but the exact one.
            pub const TURNED: &[Self] = &[$(Self::$choice),*];

            /// The knob that it turns, and how far.
            pub fn name(self) -> (&'static str, &'static str) {
                match self {
                    Self::Exact => ("arithmetic", "exact"),
                    $(Self::$choice => ($knob, $name),)*
                }
            }

            /// Calls `with` for the type that it stands for.
            pub fn call<W: WithArithmetic>(self, with: W) -> W::Output {
                match self {
                    Self::Exact => with.call::<Exact>(),
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
    F16Weights, "heads", "weights f16", With<F16>, "Halves of weights, sums in f32.";
    StrictF16, "heads", "strict f16", With<StrictF16>, "Every product and sum a half.";
    I16, "heads", "i16", With<I16>, "Heads in 16-bit integers.";
    I8, "heads", "weights i8", With<I8>, "The same, weights of 8 bits.";
    Libm, "functions", "libm", With<F32, Libm>, "Functions of libm.";
    Polynomial, "functions", "polynomial", With<F32, Polynomial>, "Functions right to 10⁻⁴.";
    Table, "functions", "table", With<F32, Table>, "Functions from a table.";
    Fast, "roots", "fast", With<F32, Precise, Fast>, "Roots right to 10⁻⁶.";
    Narrow, "splats", "16 bits", With<F32, Precise, Ieee, Narrow>, "Splats in 20 bytes.";
    Wide, "splats", "f32", With<F32, Precise, Ieee, Wide>, "Splats in 40 bytes.";
    Depth16, "depth keys", "16 bits", With<F32, Precise, Ieee, Mixed, Depth16>, "Order by the upper half of the depth.";
    Rgb565, "colours", "5-6-5", With<F32, Precise, Ieee, Mixed, Depth32, Rgb565>, "5, 6 and 5 bits a channel.";
    Rgb565Dithered, "colours", "5-6-5, dithered", With<F32, Precise, Ieee, Mixed, Depth32, Rgb565Dithered>, "The same, dithered.";
    FastPolynomial, "together", "polynomial, fast roots", Quick, "What is cheaper in every part that floats take.";
    FastPolynomialDepth16, "together", "polynomial, fast roots, 16-bit keys", With<F32, Polynomial, Fast, Mixed, Depth16>, "The same with fewer passes of sorting.";
    Integer, "together", "i16, polynomial, fast roots", QuickWithoutFpu, "The same with heads in integers.";
}

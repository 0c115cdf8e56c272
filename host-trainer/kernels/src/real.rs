//! The number type of an operation.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number: f32 in training, f64 in the gradient checks.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Sum
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// The nearest value to `value`.
    fn real(value: f64) -> Self;
    /// e^x. In f32 the decoder's own polynomial, which vectorises; see [`pocketsplat_format::math::exp`].
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Binary logarithm of a positive, normal number. In f32 a series that vectorises.
    fn log2(self) -> Self;
    /// The nearest integer, ties to even.
    fn round_ties_even(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Whether the value is neither infinite nor NaN.
    fn is_finite(self) -> bool;

    /// The larger of two values that are not NaN; a comparison and a select, so that loops over it vectorise.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller of two values that are not NaN.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// 1/(1 + e^−x).
    #[inline(always)]
    fn sigmoid(self) -> Self {
        Self::ONE / (Self::ONE + (-self).exp())
    }

    /// tanh x = 2·sigmoid(2x) − 1 away from zero, and x − x³/3 + 2x⁵/15 near it, where the difference would cancel.
    #[inline(always)]
    fn tanh(self) -> Self {
        let square = self * self;
        if square < Self::real(1e-4) {
            return self
                * (Self::ONE
                    - square
                        * (Self::real(1.0 / 3.0)
                            - square * (Self::real(2.0 / 15.0) - square * Self::real(17.0 / 315.0))));
        }
        let two = Self::real(2.0);
        two * (two * self).sigmoid() - Self::ONE
    }

    /// `C = alpha·A·B + beta·C`; see [`crate::ops::heads::matmul`].
    ///
    /// # Safety
    /// As `matrixmultiply::sgemm`: every index reached through the strides lies inside its allocation.
    #[expect(unsafe_code, reason = "the product works on raw strided pointers; ops::matmul checks every extent")]
    unsafe fn gemm(
        size: [usize; 3],
        a: (*const Self, [isize; 2]),
        b: (*const Self, [isize; 2]),
        beta: Self,
        c: (*mut Self, [isize; 2]),
    );
}

/// Methods of [`Real`] that floats have by the same names.
macro_rules! as_of_floats {
    ($($name:ident -> $output:ty),*) => {
        $(#[inline(always)]
        fn $name(self) -> $output {
            self.$name()
        })*
    };
}

macro_rules! real {
    ($t:ty, $gemm:path, $exp:expr, $log2:expr) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;

            #[inline(always)]
            fn real(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline(always)]
            fn log2(self) -> Self {
                $log2(self)
            }
            as_of_floats!(ln -> Self, round_ties_even -> Self, sqrt -> Self, abs -> Self, is_finite -> bool);
            #[expect(unsafe_code, reason = "see the trait")]
            unsafe fn gemm(
                [m, k, n]: [usize; 3],
                (a, [rsa, csa]): (*const Self, [isize; 2]),
                (b, [rsb, csb]): (*const Self, [isize; 2]),
                beta: Self,
                (c, [rsc, csc]): (*mut Self, [isize; 2]),
            ) {
                // SAFETY: the caller keeps the promise of the trait.
                unsafe { $gemm(m, k, n, 1.0, a, rsa, csa, b, rsb, csb, beta, c, rsc, csc) }
            }
        }
    };
}

real!(f32, matrixmultiply::sgemm, pocketsplat_format::math::exp, log2_series);
real!(f64, matrixmultiply::dgemm, f64::exp, f64::log2);

/// log₂ x = n + 2·artanh((m − 1)/(m + 1))/ln 2 with x = 2ⁿ·m, m in [√½, √2), where five terms leave less than 1e-9.
#[inline(always)]
fn log2_series(x: f32) -> f32 {
    /// 2/ln 2 · 1/(2i + 1).
    const TERMS: [f32; 5] = [2.885_39, 0.961_796_7, 0.577_078_04, 0.412_198_6, 0.320_598_9];
    let sqrt_half = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    let shifted = x.to_bits().wrapping_sub(sqrt_half);
    let n = (shifted.cast_signed() >> 23) as f32;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(sqrt_half));
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    let [t0, t1, t2, t3, t4] = TERMS;
    n + s * ((((t4 * square + t3) * square + t2) * square + t1) * square + t0)
}

/// `[f(0), f(1), f(2)]`, one value an axis; unlike `std::array::from_fn` it is always inlined.
#[inline(always)]
pub(super) fn per_axis<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

#[cfg(test)]
mod tests {
    use super::Real;

    #[test]
    fn the_binary_logarithm_agrees_with_std() {
        for i in -126..127 {
            for j in 0..300 {
                let x = (i as f32 + j as f32 / 300.0).exp2();
                let exact = f64::from(x).log2();
                let error = (f64::from(Real::log2(x)) - exact).abs();
                assert!(error <= 2e-7 * exact.abs().max(1.0), "log2({x}) errs by {error}");
            }
        }
        assert_eq!(Real::log2(1.0f32), 0.0);
    }

    #[test]
    fn tanh_agrees_with_std_on_both_branches() {
        for i in -4000..4000 {
            let x = f64::from(i) * 1e-3;
            assert!((Real::tanh(x) - f64::tanh(x)).abs() <= 1e-14, "tanh({x})");
            let y = x as f32;
            let exact = f64::tanh(f64::from(y));
            assert!((f64::from(Real::tanh(y)) - exact).abs() <= 3e-7, "f32 tanh({y})");
        }
    }
}

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
    /// e^x. In f32 the decoder's own polynomial, which vectorises; see [`pocketsplat_core::math::exp`].
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
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

    /// `C = alpha·A·B + beta·C`; see [`super::matmul`].
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

macro_rules! real {
    ($t:ty, $gemm:path, $exp:expr) => {
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
            fn ln(self) -> Self {
                self.ln()
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
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

real!(f32, matrixmultiply::sgemm, pocketsplat_core::math::exp);
real!(f64, matrixmultiply::dgemm, f64::exp);

/// `[f(0), f(1), f(2)]`, one value an axis; unlike `std::array::from_fn` it is always inlined.
#[inline(always)]
pub(super) fn per_axis<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

#[cfg(test)]
mod tests {
    use super::Real;

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

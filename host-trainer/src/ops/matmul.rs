//! Matrix products on slices: a checked door to `matrixmultiply`.

use super::Real;

/// A row-major matrix, or the transpose of one, borrowed from a slice.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a, R> {
    values: &'a [R],
    rows: usize,
    cols: usize,
    transposed: bool,
}

impl<'a, R> Matrix<'a, R> {
    /// `values` as `[rows, cols]`, row-major.
    ///
    /// # Panics
    /// When `values` has another length.
    pub fn new(values: &'a [R], rows: usize, cols: usize) -> Self {
        assert_eq!(values.len(), rows * cols, "a {rows}×{cols} matrix needs that many values");
        Self { values, rows, cols, transposed: false }
    }

    /// The transpose, without moving anything.
    pub fn t(self) -> Self {
        Self { transposed: !self.transposed, ..self }
    }

    /// `[rows, cols]` as seen from outside.
    fn extent(&self) -> [usize; 2] {
        if self.transposed { [self.cols, self.rows] } else { [self.rows, self.cols] }
    }

    fn strides(&self) -> [isize; 2] {
        let across = isize::try_from(self.cols).expect("a slice holds at most isize::MAX bytes");
        if self.transposed { [1, across] } else { [across, 1] }
    }
}

/// `out = a·b` (or `out += a·b` with `accumulate`), `out` row-major `[rows of a, columns of b]`.
///
/// Sums run in the order `matrixmultiply` chooses for the CPU at hand: the same on one machine for any thread count,
/// not on two CPU models.
///
/// # Panics
/// When the extents do not fit together.
pub fn multiply<R: Real>(a: Matrix<'_, R>, b: Matrix<'_, R>, accumulate: bool, out: &mut [R]) {
    let [m, k] = a.extent();
    let [k_b, n] = b.extent();
    assert_eq!(k, k_b, "columns of a and rows of b");
    assert_eq!(out.len(), m * n, "the product is {m}×{n}");
    let beta = if accumulate { R::ONE } else { R::ZERO };
    let out_strides = [isize::try_from(n).expect("a slice holds at most isize::MAX bytes"), 1];
    #[expect(unsafe_code, reason = "matrixmultiply takes pointers and strides")]
    // SAFETY: `Matrix::new` ties each extent and its strides to the length of its slice, and `out` holds m·n values.
    unsafe {
        R::gemm(
            [m, k, n],
            (a.values.as_ptr(), a.strides()),
            (b.values.as_ptr(), b.strides()),
            beta,
            (out.as_mut_ptr(), out_strides),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transposes_and_accumulates() {
        let a = [1.0f64, 2.0, 3.0, 4.0, 5.0, 6.0];
        let mut out = [100.0; 4];
        multiply(Matrix::new(&a, 2, 3), Matrix::new(&a, 2, 3).t(), true, &mut out);
        assert_eq!(out, [114.0, 132.0, 132.0, 177.0]);
        let mut out = [0.0; 9];
        multiply(Matrix::new(&a, 2, 3).t(), Matrix::new(&a, 2, 3), false, &mut out);
        assert_eq!(out, [17.0, 22.0, 27.0, 22.0, 29.0, 36.0, 27.0, 36.0, 45.0]);
    }
}

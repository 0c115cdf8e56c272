//! Matrix products on slices: a checked door to `matrixmultiply`.

use crate::real::Real;

/// A row-major matrix, or the transpose of one, borrowed from a slice; the first columns of one.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a, R> {
    values: &'a [R],
    rows: usize,
    cols: usize,
    /// Values from one row to the next.
    stride: usize,
    transposed: bool,
}

impl<'a, R> Matrix<'a, R> {
    /// `values` as `[rows, cols]`, row-major.
    ///
    /// # Panics
    /// When `values` has another length.
    pub fn new(values: &'a [R], rows: usize, cols: usize) -> Self {
        assert_eq!(values.len(), rows * cols, "a {rows}×{cols} matrix needs that many values");
        Self { values, rows, cols, stride: cols, transposed: false }
    }

    /// The first `cols` columns of `values`, `rows` rows of at least as many.
    ///
    /// # Panics
    /// When `values` does not consist of such rows.
    pub fn first_columns(values: &'a [R], rows: usize, cols: usize) -> Self {
        Self { values, rows, cols, stride: stride(values.len(), rows, cols), transposed: false }
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
        let across = isize::try_from(self.stride).expect("a slice holds at most isize::MAX bytes");
        if self.transposed { [1, across] } else { [across, 1] }
    }
}

/// The length of each of the `rows` that `len` values consist of, at least `cols`.
fn stride(len: usize, rows: usize, cols: usize) -> usize {
    let stride = len.checked_div(rows).unwrap_or(cols);
    assert!(stride >= cols && stride * rows == len, "{rows} rows of at least {cols} of {len} values");
    stride
}

/// `out = a·b` (or `out += a·b` with `accumulate`), `out` row-major with the rows of a; its first columns are those of b, and what
/// lies behind them stays.
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
    let beta = if accumulate { R::ONE } else { R::ZERO };
    let out_strides = [isize::try_from(stride(out.len(), m, n)).expect("a slice holds at most isize::MAX bytes"), 1];
    #[expect(unsafe_code, reason = "matrixmultiply takes pointers and strides")]
    // SAFETY: each matrix's extent and stride are tied to the length of its slice where it is made, and those of `out` by `stride`.
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

    #[test]
    fn the_first_columns_are_read_and_written_alone() {
        let a = [1.0f64, 2.0, -9.0, 3.0, 4.0, -9.0];
        let b = [1.0, 0.0, 1.0, 1.0];
        let mut out = [7.0; 8];
        multiply(Matrix::first_columns(&a, 2, 2), Matrix::new(&b, 2, 2), false, &mut out);
        assert_eq!(out, [3.0, 2.0, 7.0, 7.0, 7.0, 4.0, 7.0, 7.0]);
        let mut out = [0.0; 4];
        multiply(Matrix::first_columns(&a, 2, 2).t(), Matrix::first_columns(&a, 2, 2), false, &mut out);
        assert_eq!(out, [10.0, 14.0, 14.0, 20.0]);
        multiply(Matrix::first_columns(&a[..0], 0, 2), Matrix::new(&b, 2, 2), false, &mut []);
    }

    #[test]
    #[should_panic(expected = "2 rows of at least 3 of 4 values")]
    fn rows_that_are_too_short_are_refused() {
        Matrix::first_columns(&[0.0; 4], 2, 3);
    }
}

//! Mean absolute difference of two images.

use rayon::prelude::*;

use crate::real::Real;

/// Values that one task takes: a fixed number, so that a sum's rounding is the same for any number of threads.
pub(crate) const BLOCK: usize = 4096;

/// `mean |image − truth|` over pixels and channels.
pub fn forward<R: Real>(image: &[R], truth: &[R]) -> R {
    let blocks = image.par_chunks(BLOCK).zip(truth.par_chunks(BLOCK));
    let sums: Vec<R> = blocks.map(|(a, b)| a.iter().zip(b).map(|(x, y)| (*x - *y).abs()).sum::<R>()).collect();
    sums.into_iter().sum::<R>() / R::real(image.len() as f64)
}

/// Adds `weight · sign(image − truth)/n` to `d_image`; zero where they are equal.
pub fn backward<R: Real>(image: &[R], truth: &[R], weight: R, d_image: &mut [R]) {
    let step = weight / R::real(image.len() as f64);
    let blocks = image.par_chunks(BLOCK).zip(truth.par_chunks(BLOCK)).zip(d_image.par_chunks_mut(BLOCK));
    blocks.for_each(|((image, truth), d_image)| {
        for ((x, y), d) in image.iter().zip(truth).zip(d_image) {
            let above = if *x > *y { step } else { R::ZERO };
            let below = if *x < *y { step } else { R::ZERO };
            *d += above - below;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let (x, truth) = (random(1, 60), random(2, 60));
        let mut d = vec![0.0; 60];
        backward(&x, &truth, 0.8, &mut d);
        assert_gradient("l1", &x, &d, |x| 0.8 * forward(x, &truth));
        let mut d = vec![0.0; 60];
        backward(&truth, &truth, 0.8, &mut d);
        assert!(d.iter().all(|d| *d == 0.0), "no gradient where nothing differs");
    }
}

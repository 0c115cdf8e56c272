//! The Pareto front: what nothing else beats.

/// For each point of (cost, quality), whether no other has less cost at no less quality, or more quality at no more cost.
///
/// Cost: n log n. Of equal points the first is on the front.
pub fn on_front(points: &[(f64, f64)]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        let ((cost_a, quality_a), (cost_b, quality_b)) = (points[a], points[b]);
        cost_a.total_cmp(&cost_b).then(quality_b.total_cmp(&quality_a)).then(a.cmp(&b))
    });
    let mut front = vec![false; points.len()];
    let mut best = f64::NEG_INFINITY;
    for i in order {
        let (_, quality) = points[i];
        front[i] = quality > best;
        best = best.max(quality);
    }
    front
}

#[cfg(test)]
mod tests {
    use super::on_front;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [(3.0, 30.0), (1.0, 20.0), (2.0, 19.0), (2.0, 25.0), (2.0, 25.0), (4.0, 30.0), (1.5, 20.0)];
        assert_eq!(on_front(&points), [true, true, false, true, false, false, false]);
        for (i, &(cost, quality)) in points.iter().enumerate() {
            let beaten = points.iter().any(|&(c, q)| (c < cost && q >= quality) || (c <= cost && q > quality));
            assert!(!on_front(&points)[i] || !beaten, "by hand: {i}");
        }
    }
}

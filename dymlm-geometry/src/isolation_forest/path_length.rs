/// Euler's constant.
const EULER: f64 = 0.577_215_664_901_532_9;

/// c(n): the mean length of an unsuccessful search's path in a binary search tree of `n` items, by which path
/// lengths are normalized, and which stands for the part of a tree below a leaf of `n` rows that was not
/// grown. Liu 2008, eq. 1, with H(i) = ln(i) + 0.5772 as published; for two items 1, as in Liu 2012.
pub(super) fn mean_path_length(n: usize) -> f64 {
    let items = n as f64;
    match n {
        0 | 1 => 0.0,
        2 => 1.0,
        _ => 2.0 * ((items - 1.0).ln() + EULER) - 2.0 * (items - 1.0) / items,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_the_mean_path_of_a_search_that_fails() {
        assert_eq!([mean_path_length(0), mean_path_length(1), mean_path_length(2)], [0.0, 0.0, 1.0]);
        // 2 H(n - 1) - 2 (n - 1) / n with the harmonic number summed; the logarithm is short by about 1 / (n
        // - 1).
        for n in [10, 256, 10_000] {
            let harmonic: f64 = (1..n).map(|i| 1.0 / f64::from(i)).sum();
            let exact = 2.0 * harmonic - 2.0 * f64::from(n - 1) / f64::from(n);
            let short = exact - mean_path_length(n as usize);
            assert!((0.0..1.1 / f64::from(n - 1)).contains(&short), "{n}: {short}");
        }
        // scikit-learn 1.9: sklearn.ensemble._iforest._average_path_length([256]).
        assert!((mean_path_length(256) - 10.244_770_920_119_917).abs() < 1e-12);
    }
}

use super::incomplete_beta::{incomplete_beta, inverted};

/// The value below which a Fisher F variable with `numerator` and `denominator` > 0 degrees of freedom lies with
/// probability `p`; `None` when `p` is not within 0 < p < 1 or a number of degrees of freedom is none.
///
/// By inverting the incomplete beta function; relative error below 1e-9.
///
/// ```
/// let f = dymlm_objects::fisher_f_quantile(0.95, 3.0, 10.0).expect("a probability");
/// assert!((f - 3.708_264_8).abs() < 1e-6);
/// ```
pub fn fisher_f_quantile(p: f64, numerator: f64, denominator: f64) -> Option<f64> {
    let degrees_exist = [numerator, denominator].iter().all(|n| *n > 0.0 && n.is_finite());
    if !(p > 0.0 && p < 1.0 && degrees_exist) {
        return None;
    }
    // With x = d2 / (d1 f + d2), the tail beyond f holds I_x(d2 / 2, d1 / 2): exact where p is near 1.
    let x = inverted(1.0 - p, |x| incomplete_beta(0.5 * denominator, 0.5 * numerator, x));
    Some(denominator * (1.0 - x) / (numerator * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_scipy() {
        // scipy.stats.f.ppf(p, d1, d2) of scipy 1.17; F(1, n) is also the square of Student's t(n).
        for (p, numerator, denominator, expected) in [
            (0.95, 3.0, 1.0, 215.707_345_369_608_65),
            (0.95, 3.0, 6.0, 4.757_062_663_089_412),
            (0.95, 3.0, 27.0, 2.960_351_318_411_286),
            (0.99, 3.0, 10.0, 6.552_312_557_515_208),
            (0.95, 1.0, 8.0, 5.317_655_071_578_713),
        ] {
            let f = fisher_f_quantile(p, numerator, denominator).unwrap();
            assert!((f - expected).abs() < 1e-10 * expected, "{p} {numerator} {denominator}: {f}");
        }
    }

    #[test]
    fn no_probability_has_no_quantile() {
        assert_eq!(fisher_f_quantile(1.0, 3.0, 3.0), None);
        assert_eq!(fisher_f_quantile(f64::NAN, 3.0, 3.0), None);
        assert_eq!(fisher_f_quantile(0.5, 0.0, 3.0), None);
    }
}

use super::incomplete_beta::{incomplete_beta, inverted};

/// The value below which a Student t variable with `degrees` > 0 degrees of freedom lies with probability `p`;
/// `None` when `p` is not within 0 < p < 1 or there are no degrees of freedom.
///
/// By inverting the incomplete beta function; relative error below 1e-9.
///
/// ```
/// let t = dymlm_objects::student_t_quantile(0.975, 8.0).expect("a probability");
/// assert!((t - 2.306_004_135_2).abs() < 1e-9);
/// ```
pub fn student_t_quantile(p: f64, degrees: f64) -> Option<f64> {
    if !(p > 0.0 && p < 1.0 && degrees > 0.0 && degrees.is_finite()) {
        return None;
    }
    let tail = 2.0 * p.min(1.0 - p);
    // With x = nu / (nu + t^2), the two tails beyond |t| hold I_x(nu / 2, 1 / 2).
    let x = inverted(tail, |x| incomplete_beta(0.5 * degrees, 0.5, x));
    let t = if tail >= 1.0 { 0.0 } else { (degrees * (1.0 - x) / x).sqrt() };
    Some(if p < 0.5 { -t } else { t })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_scipy() {
        // scipy.stats.t.ppf(p, nu) of scipy 1.17.
        for (p, degrees, expected) in [
            (0.975, 1.0, 12.706_204_736_174_694),
            (0.975, 2.0, 4.302_652_729_749_462),
            (0.975, 8.0, 2.306_004_135_204_166),
            (0.975, 29.0, 2.045_229_642_132_703),
            (0.995, 5.0, 4.032_142_983_555_228),
            (0.9, 100.0, 1.290_074_761_346_516),
            (0.025, 8.0, -2.306_004_135_204_166),
        ] {
            let t = student_t_quantile(p, degrees).unwrap();
            assert!((t - expected).abs() < 1e-11 * expected.abs(), "{p} {degrees}: {t}");
        }
        assert_eq!(student_t_quantile(0.5, 3.0), Some(0.0));
    }

    #[test]
    fn no_probability_has_no_quantile() {
        for p in [0.0, 1.0, -0.1, f64::NAN] {
            assert_eq!(student_t_quantile(p, 3.0), None);
        }
        assert_eq!(student_t_quantile(0.9, 0.0), None);
    }
}

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// The value below which a Student t variable with `degrees` degrees of freedom lies with probability `p`;
/// `None` when `p` is not within 0 < p < 1 or there are no degrees of freedom.
pub(crate) fn student_t_quantile(p: f64, degrees: f64) -> Option<f64> {
    let distribution = StudentsT::new(0.0, 1.0, degrees).ok().filter(|_| degrees.is_finite())?;
    is_probability(p).then(|| distribution.inverse_cdf(p))
}

/// The value below which a Fisher F variable with these degrees of freedom lies with probability `p`; `None`
/// when `p` is not within 0 < p < 1 or a number of degrees of freedom is not positive.
pub(crate) fn fisher_f_quantile(p: f64, numerator: f64, denominator: f64) -> Option<f64> {
    // 1 / F has an F distribution with the degrees of freedom exchanged; near p = 1 its quantile keeps more
    // digits.
    let inverse = FisherSnedecor::new(denominator, numerator).ok()?;
    is_probability(p).then(|| 1.0 / inverse.inverse_cdf(1.0 - p))
}

/// Whether p is within 0 < p < 1: `statrs` panics outside 0..=1, and the quantiles of 0 and 1 may be
/// infinite.
fn is_probability(p: f64) -> bool {
    p > 0.0 && p < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_scipy() {
        // scipy.stats.t.ppf(p, nu) and f.ppf(p, d1, d2) of scipy 1.17; F(1, n) is also the square of
        // Student's t(n).
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
        assert!(student_t_quantile(0.5, 3.0).unwrap().abs() < 1e-15);
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
    fn what_is_no_probability_has_no_quantile() {
        for p in [0.0, 1.0, -0.1, f64::NAN] {
            assert_eq!((student_t_quantile(p, 3.0), fisher_f_quantile(p, 3.0, 3.0)), (None, None));
        }
        for degrees in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(
                (student_t_quantile(0.9, degrees), fisher_f_quantile(0.9, 3.0, degrees)),
                (None, None)
            );
        }
    }
}

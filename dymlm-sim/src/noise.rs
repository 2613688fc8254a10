//! Random numbers that depend on their purpose, not on the order in which they are drawn.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a stream of random numbers is used for: streams of different uses share nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Use {
    Scene = 0,
    Sensor = 1,
    Confidence = 2,
    Boxes = 3,
    PoseError = 4,
}

/// The stream of random numbers for one seed and purpose, `index` (below 2^32) and `part` (below 2^28).
pub(crate) fn stream(seed: u64, purpose: Use, index: u64, part: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(((purpose as u64) << 60) ^ (index << 28) ^ part);
    rng
}

/// Turns 12 random bits into a standard normal number: one of 4096 equally likely quantiles, within 3.7
/// sigma.
#[derive(Debug, Clone)]
pub(crate) struct NormalTable {
    quantiles: Vec<f32>,
}

impl NormalTable {
    pub(crate) fn new() -> Self {
        Self { quantiles: (0..4096).map(|i| normal_quantile((f64::from(i) + 0.5) / 4096.0) as f32).collect() }
    }

    /// The normal number that the lowest 12 bits select.
    #[inline]
    pub(crate) fn normal(&self, bits: u64) -> f32 {
        self.quantiles[(bits & 0xfff) as usize]
    }
}

/// The x below which a standard normal variable falls with probability `p`; infinite at 0 and 1. Relative
/// error below 1.2e-9 (P. J. Acklam's rational approximation, 2003).
pub(crate) fn normal_quantile(p: f64) -> f64 {
    const TAIL: f64 = 0.02425;
    if p <= 0.0 {
        f64::NEG_INFINITY
    } else if p >= 1.0 {
        f64::INFINITY
    } else if p < TAIL {
        tail_quantile(p)
    } else if p > 1.0 - TAIL {
        -tail_quantile(1.0 - p)
    } else {
        let q = p - 0.5;
        let r = q * q;
        let numerator = polynomial(
            r,
            &[
                -3.969_683_028_665_376e1,
                2.209_460_984_245_205e2,
                -2.759_285_104_469_687e2,
                1.383_577_518_672_69e2,
                -3.066_479_806_614_716e1,
                2.506_628_277_459_239,
            ],
        );
        let denominator = polynomial(
            r,
            &[
                -5.447_609_879_822_406e1,
                1.615_858_368_580_409e2,
                -1.556_989_798_598_866e2,
                6.680_131_188_771_972e1,
                -1.328_068_155_288_572e1,
                1.0,
            ],
        );
        q * numerator / denominator
    }
}

fn tail_quantile(p: f64) -> f64 {
    let q = (-2.0 * p.ln()).sqrt();
    let numerator = polynomial(
        q,
        &[
            -7.784_894_002_430_293e-3,
            -3.223_964_580_411_365e-1,
            -2.400_758_277_161_838,
            -2.549_732_539_343_734,
            4.374_664_141_464_968,
            2.938_163_982_698_783,
        ],
    );
    let denominator = polynomial(
        q,
        &[
            7.784_695_709_041_462e-3,
            3.224_671_290_700_398e-1,
            2.445_134_137_142_996,
            3.754_408_661_907_416,
            1.0,
        ],
    );
    numerator / denominator
}

/// Horner's rule, highest power first.
fn polynomial(x: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, x) in [
            (0.5, 0.0),
            (0.975, 1.959_963_985),
            (0.841_344_746, 1.0),
            (0.01, -2.326_347_874),
            (0.001, -3.090_232_306),
        ] {
            assert!((normal_quantile(p) - x).abs() < 1e-6, "{p}: {}", normal_quantile(p));
        }
        assert_eq!(normal_quantile(0.0), f64::NEG_INFINITY);
    }

    #[test]
    fn the_table_has_the_moments_of_a_normal_variable() {
        let table = NormalTable::new();
        let moment = |k: i32| (0..4096).map(|i| f64::from(table.normal(i)).powi(k)).sum::<f64>() / 4096.0;
        assert!(moment(1).abs() < 1e-6 && (moment(2) - 1.0).abs() < 2e-3 && (moment(4) - 3.0).abs() < 0.05);
    }

    #[test]
    fn streams_differ() {
        let first = |seed, purpose, index, part| stream(seed, purpose, index, part).next_u64();
        let base = first(1, Use::Sensor, 5, 6);
        assert_eq!(base, first(1, Use::Sensor, 5, 6));
        for other in [first(2, Use::Sensor, 5, 6), first(1, Use::Boxes, 5, 6), first(1, Use::Sensor, 6, 5)] {
            assert_ne!(base, other);
        }
    }
}

/// The spread of errors: the smallest values that half and 95 % of the errors do not exceed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 95 % quantile.
    pub p95: f64,
}

impl Spread {
    /// The spread of some values; `None` when there are none.
    pub(crate) fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let quantile = |percent: usize| {
            let rank = (values.len() * percent).div_ceil(100).max(1) - 1;
            values.get(rank).copied()
        };
        Some(Self { median: quantile(50)?, p95: quantile(95)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values() {
        let spread = Spread::of((1..=100).rev().map(f64::from).collect()).unwrap();
        assert_eq!((spread.median, spread.p95), (50.0, 95.0));
        assert_eq!(Spread::of(vec![3.0]), Some(Spread { median: 3.0, p95: 3.0 }));
        assert_eq!(Spread::of(Vec::new()), None);
    }
}

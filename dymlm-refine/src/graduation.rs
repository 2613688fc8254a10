/// Factor by which, from round to round, the cost comes nearer to one that large errors do not add to; greater
/// where errors are so large that it would not get there in time.
const RATE: f64 = 1.4;
/// Most rounds. By then the cost is the truncated one: a weight that still changes has an error at the limit.
const MOST_ROUNDS: usize = 100;
/// Rounds after which the nearness is 1 at the latest, whatever the largest error. With [`RATE`] alone an error
/// of 3e8 takes so many; a loop closure that is 1,000 km off (4e16) took more than all rounds, and in the
/// last one each right factor had less than half of its weight.
const ROUNDS_TO_ONE: f64 = 60.0;

/// Weights of factors some of which may be wrong, round by round: the first cost has a single minimum, in the
/// end each weight is 0 or 1. Graduated non-convexity with truncated least squares (Yang et al., RA-L 2020,
/// equations 12 to 14). Errors are squared, and divided by the largest squared error of a right factor.
#[derive(Debug)]
pub(crate) struct Graduation {
    errors: Vec<f64>,
    weights: Vec<f64>,
    /// How near the cost is to the truncated one: mu in the paper.
    nearness: f64,
    /// Factor by which the nearness grows while it is below 1.
    rate: f64,
    rounds: usize,
}

impl Graduation {
    /// `errors`: those with all weights 1.
    pub(crate) fn begin(errors: Vec<f64>) -> Self {
        // An infinite error is wrong however near the cost is.
        let largest = errors.iter().copied().fold(0.0, f64::max).min(f64::MAX / 4.0);
        let nearness = 1.0 / (2.0 * largest - 1.0).max(1.0);
        let rate = RATE.max(nearness.powf(-1.0 / ROUNDS_TO_ONE));
        Self { weights: vec![1.0; errors.len()], errors, nearness, rate, rounds: 0 }
    }

    /// The weights of the next round; `None` when the last ones are final.
    pub(crate) fn next(&mut self) -> Option<&[f64]> {
        let weights: Vec<f64> = self.errors.iter().map(|&error| self.weight(error)).collect();
        if self.are_final() && (weights == self.weights || self.rounds == MOST_ROUNDS) {
            return None;
        }
        (self.weights, self.rounds) = (weights, self.rounds + 1);
        Some(&self.weights)
    }

    /// Whether the weights may be the last: each factor is right or wrong. Others are about to change.
    pub(crate) fn are_final(&self) -> bool {
        self.rounds == MOST_ROUNDS || self.weights.iter().all(|weight| [0.0, 1.0].contains(weight))
    }

    /// Takes the errors after a round.
    pub(crate) fn look_at(&mut self, errors: Vec<f64>) {
        self.errors = errors;
        self.nearness *= if self.nearness < 1.0 { self.rate } else { RATE };
    }

    fn weight(&self, error: f64) -> f64 {
        let mu = self.nearness;
        if error <= mu / (mu + 1.0) {
            1.0
        } else if error >= (mu + 1.0) / mu {
            0.0
        } else {
            ((mu * (mu + 1.0) / error).sqrt() - mu).clamp(0.0, 1.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of distances of 1e160 m are infinite.
    #[test]
    fn an_error_without_a_limit_is_the_only_one_that_is_wrong() {
        for wrong in [1e4, 1e16, 1e300, f64::MAX, f64::INFINITY] {
            let errors = vec![0.05, wrong, 0.27, 0.6];
            let mut graduation = Graduation::begin(errors.clone());
            let mut last = Vec::new();
            while let Some(weights) = graduation.next() {
                last = weights.to_vec();
                graduation.look_at(errors.clone());
            }
            assert_eq!(last, [1.0, 0.0, 1.0, 1.0], "{wrong}");
        }
    }
}

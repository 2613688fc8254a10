/// Between two rounds the cost comes nearer to one that errors above the limit do not add to by this factor.
const RATE: f64 = 1.4;
/// After so many rounds the cost is the truncated one: one whose weight still changes has an error at the limit.
const MOST_ROUNDS: usize = 100;

/// Weights of relative poses of which some may be wrong, round by round: first by a cost that has one minimum,
/// in the end each is 0 or 1. Graduated non-convexity with truncated least squares (Yang et al., RA-L 2020,
/// equations 12 to 14).
#[derive(Debug)]
pub(crate) struct Graduation {
    /// Largest squared error of what is right.
    limit: f64,
    /// Squared errors.
    errors: Vec<f64>,
    weights: Vec<f64>,
    /// How near the cost is to the truncated one: mu of the paper.
    nearness: f64,
    rounds: usize,
}

impl Graduation {
    /// `errors`: squared, when all weights are 1.
    pub(crate) fn begin(errors: Vec<f64>, limit: f64) -> Self {
        let largest = errors.iter().copied().fold(0.0, f64::max);
        let nearness = limit / (2.0 * largest - limit).max(limit);
        Self { limit, weights: vec![1.0; errors.len()], errors, nearness, rounds: 0 }
    }

    /// The weights of the next round; `None` when the last ones are to stay.
    pub(crate) fn next(&mut self) -> Option<&[f64]> {
        let weights: Vec<f64> = self.errors.iter().map(|&error| self.weight(error)).collect();
        let is_decided = |weights: &[f64]| weights.iter().all(|weight| [0.0, 1.0].contains(weight));
        if is_decided(&weights) && weights == self.weights || self.rounds == MOST_ROUNDS {
            return None;
        }
        (self.weights, self.rounds) = (weights, self.rounds + 1);
        Some(&self.weights)
    }

    /// Takes the squared errors after a round.
    pub(crate) fn look_at(&mut self, errors: Vec<f64>) {
        self.errors = errors;
        self.nearness *= RATE;
    }

    /// Those that are left out.
    pub(crate) fn left_out(&self) -> Vec<usize> {
        let out = self.weights.iter().enumerate().filter(|(_, weight)| **weight < 0.5);
        out.map(|(index, _)| index).collect()
    }

    fn weight(&self, error: f64) -> f64 {
        let mu = self.nearness;
        if error <= mu / (mu + 1.0) * self.limit {
            1.0
        } else if error >= (mu + 1.0) / mu * self.limit {
            0.0
        } else {
            ((self.limit / error * mu * (mu + 1.0)).sqrt() - mu).clamp(0.0, 1.0)
        }
    }
}

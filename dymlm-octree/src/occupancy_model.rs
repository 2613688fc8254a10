use crate::{CellState, OctreeConfig};

/// A cell is occupied from probability 0.5 on: OctoMap's threshold, which its server for ROS does not let one
/// set either.
const OCCUPIED: f32 = 0.0;

/// What one hit and one miss say of a cell, and how sure a cell can become: the probabilities of an
/// [`OctreeConfig`] as log-odds, in single precision as OctoMap keeps them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OccupancyModel {
    pub(crate) hit: f32,
    pub(crate) miss: f32,
    pub(crate) min: f32,
    pub(crate) max: f32,
}

/// log(p / (1 - p)).
pub(crate) fn log_odds(probability: f64) -> f32 {
    (probability / (1.0 - probability)).ln() as f32
}

/// The probability of log-odds.
pub(crate) fn probability(log_odds: f32) -> f64 {
    1.0 - 1.0 / (1.0 + f64::from(log_odds).exp())
}

impl OccupancyModel {
    pub(crate) fn new(config: &OctreeConfig) -> Self {
        Self {
            hit: log_odds(config.p_hit),
            miss: log_odds(config.p_miss),
            min: log_odds(config.p_clamp_min),
            max: log_odds(config.p_clamp_max),
        }
    }

    /// Hornung 2013, eq. 4: the log-odds after one more observation, clamped. A value at a bound or
    /// beyond it (a file may have been written with other bounds) stays as it is.
    #[inline]
    pub(crate) fn updated(&self, log_odds: f32, update: f32) -> f32 {
        if (update >= 0.0 && log_odds >= self.max) || (update <= 0.0 && log_odds <= self.min) {
            return log_odds;
        }
        self.clamped(log_odds + update)
    }

    #[inline]
    pub(crate) fn clamped(&self, log_odds: f32) -> f32 {
        if log_odds < self.min {
            self.min
        } else if log_odds > self.max {
            self.max
        } else {
            log_odds
        }
    }

    #[inline]
    pub(crate) fn is_occupied(log_odds: f32) -> bool {
        log_odds >= OCCUPIED
    }

    #[inline]
    pub(crate) fn state(log_odds: Option<f32>) -> CellState {
        match log_odds {
            Some(log_odds) if Self::is_occupied(log_odds) => CellState::Occupied,
            Some(_) => CellState::Free,
            None => CellState::Unknown,
        }
    }

    /// The clamping bound on a value's side of the occupancy threshold.
    pub(crate) fn most_likely(&self, log_odds: f32) -> f32 {
        if Self::is_occupied(log_odds) { self.max } else { self.min }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of OctoMap 1.9.7, printed by `getProbHitLog()` and its like with nine digits.
    #[test]
    fn log_odds_are_octomaps() {
        let model = OccupancyModel::new(&OctreeConfig::default());
        assert_eq!(model.hit, 0.847_297_85);
        assert_eq!(model.miss, -0.405_465_1);
        assert_eq!(model.min, -2.000_028);
        assert_eq!(model.max, 3.511_030_7);
        assert_eq!(OCCUPIED, 0.0);
    }

    #[test]
    fn values_beyond_the_bounds_stay() {
        let model = OccupancyModel::new(&OctreeConfig::default());
        assert_eq!(model.updated(9.0, model.hit), 9.0);
        assert_eq!(model.updated(-9.0, model.miss), -9.0);
        assert_eq!(model.updated(9.0, model.miss), model.max);
        assert_eq!(model.updated(3.4, model.hit), model.max);
    }
}

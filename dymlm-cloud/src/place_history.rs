use crate::support::Support;

/// What was seen of one place over time, at the resolution of the evidence's cells
/// ([`CloudMap::history`](crate::CloudMap::history)). Older periods are longer.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaceHistory {
    /// The oldest first. The block of 8^3 cells around the place was seen when a period begins and when it ends;
    /// a long period may hold pauses.
    pub periods: Vec<PlacePeriod>,
}

/// A stretch of time in the history of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlacePeriod {
    /// When it begins, seconds on the frames' clock.
    pub from: f64,
    /// When it ends, seconds on the frames' clock.
    pub to: f64,
    /// How many frames of that time speak for and against the place.
    pub evidence: Support,
    /// Whether something stood there that did not move.
    pub is_occupied: bool,
}

impl PlaceHistory {
    /// Since when at the latest the place has been occupied, seconds; `None` when it is not.
    pub fn occupied_since(&self) -> Option<f64> {
        let occupied = self.periods.iter().rev().take_while(|period| period.is_occupied);
        occupied.last().map(|period| period.from)
    }

    /// Until when the place was last occupied, seconds; `None` when it never was. While it is occupied: the
    /// end of the last period.
    pub fn occupied_until(&self) -> Option<f64> {
        self.periods.iter().rev().find(|period| period.is_occupied).map(|period| period.to)
    }
}

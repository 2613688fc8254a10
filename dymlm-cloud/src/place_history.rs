use crate::support::Support;

/// What was seen of one place over time, at the resolution of the evidence's cells, in periods that are the
/// longer the older they are ([`CloudMap::history`](crate::CloudMap::history)).
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaceHistory {
    /// The oldest first; times in which the place was not seen are in none.
    pub periods: Vec<PlacePeriod>,
}

/// A stretch of time in the history of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlacePeriod {
    /// When it begins, seconds: the clock of the frames.
    pub from: f64,
    /// When it ends.
    pub to: f64,
    /// The frames of that time.
    pub evidence: Support,
    /// Whether something stood there that did not move.
    pub is_occupied: bool,
}

impl PlaceHistory {
    /// Since when the place is occupied, seconds, at the latest; `None` when it is not.
    pub fn occupied_since(&self) -> Option<f64> {
        let occupied = self.periods.iter().rev().take_while(|period| period.is_occupied);
        occupied.last().map(|period| period.from)
    }

    /// Until when the place was occupied the last time, seconds; `None` when it never was. When it still is:
    /// the end of the last period.
    pub fn occupied_until(&self) -> Option<f64> {
        self.periods.iter().rev().find(|period| period.is_occupied).map(|period| period.to)
    }
}

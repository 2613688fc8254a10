/// Why a trajectory gives no pose at a time.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UncoveredTime {
    /// There is no pose at all.
    #[error("no pose at {timestamp} s: the trajectory is empty")]
    Empty {
        /// The time asked for, seconds.
        timestamp: f64,
    },
    /// The time lies before the first pose (or is not finite).
    #[error("no pose at {timestamp} s: the trajectory begins at {first} s")]
    Before {
        /// The time asked for, seconds.
        timestamp: f64,
        /// Time of the first pose, seconds.
        first: f64,
    },
    /// The time lies after the last pose.
    #[error("no pose at {timestamp} s: the trajectory ends at {last} s")]
    After {
        /// The time asked for, seconds.
        timestamp: f64,
        /// Time of the last pose, seconds.
        last: f64,
    },
    /// The time lies in a gap.
    #[error(
        "no pose at {timestamp} s: the trajectory has a gap from {from} s to {to} s, longer than {max_gap} s"
    )]
    Gap {
        /// The time asked for, seconds.
        timestamp: f64,
        /// Time of the last pose before the gap, seconds.
        from: f64,
        /// Time of the first pose after the gap, seconds.
        to: f64,
        /// Longest time between poses that is interpolated over, seconds.
        max_gap: f64,
    },
}

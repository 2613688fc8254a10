/// What is no problem that can be solved. Nothing has changed when it is returned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A factor names a pose that there is not.
    #[error("pose {pose} of {poses}")]
    UnknownPose {
        /// The pose that was named.
        pose: usize,
        /// How many there are.
        poses: usize,
    },
    /// A relative pose from a pose to itself.
    #[error("a relative pose from pose {0} to itself says nothing")]
    OwnNeighbour(usize),
    /// A matrix is none of information, or of a covariance: not finite, or with a negative eigenvalue.
    #[error("the {what} is not symmetric, finite and positive semidefinite")]
    NoInformation {
        /// Which matrix.
        what: &'static str,
    },
    /// A field of the config is outside its range.
    #[error(transparent)]
    Config(#[from] dymlm_core::ConfigError),
    /// The normal equations have no solution, whatever the damping: numbers are too large.
    #[error("the normal equations cannot be solved")]
    Singular,
}

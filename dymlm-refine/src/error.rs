/// Why a problem cannot be solved. Nothing has changed when an error is returned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A factor names a pose that does not exist.
    #[error("there is no pose {pose} among {poses} poses")]
    UnknownPose {
        /// The pose that was named.
        pose: usize,
        /// How many there are.
        poses: usize,
    },
    /// A relative pose from a pose to itself.
    #[error("a relative pose from pose {0} to itself says nothing")]
    OwnNeighbour(usize),
    /// A matrix is no information or covariance matrix: not finite, or with a negative eigenvalue.
    #[error("the {what} is not symmetric, finite and positive semidefinite")]
    NoInformation {
        /// Which matrix.
        what: &'static str,
    },
    /// A field of the config is outside its range.
    #[error(transparent)]
    Config(#[from] dymlm_core::ConfigError),
    /// The normal equations have no solution at any damping: numbers are too large.
    #[error("the normal equations cannot be solved")]
    Singular,
}

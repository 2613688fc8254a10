use dymlm_core::ConfigError;

/// Why an octree refused something. A refused call changes nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field of a config outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An image or a colour buffer that does not fit the camera or the points.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// A saved map is not what was written.
    #[cfg(feature = "state")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
    /// A sensor origin that is not finite, or outside the map of 65536 cells along each axis.
    #[error("the origin {origin:?} is not inside the map, which ends at +-{half_extent} m")]
    Origin {
        /// Given origin, metres.
        origin: [f64; 3],
        /// Distance from the world's origin to the border of the map, metres.
        half_extent: f64,
    },
    /// A scan whose rays pass too many cells: the cells are too small for the range.
    #[error(
        "the rays of the scan pass more than {most} blocks of 8x8x8 cells, each of 0.7 kB: the cells are too small, or the range \
         is too long"
    )]
    ScanSize {
        /// Greatest number of blocks that is accepted.
        most: usize,
    },
    /// Two maps that cannot be merged.
    #[error("a map of {other} m cells cannot be merged into one of {resolution} m cells")]
    Resolution {
        /// Cell size of the map merged into, metres.
        resolution: f64,
        /// Cell size of the other map, metres.
        other: f64,
    },
    /// A direction or an interval of heights that describes no projection.
    #[error("no projection along up = {up:?} between the heights {min_height} and {max_height} m")]
    Projection {
        /// Given direction.
        up: [f64; 3],
        /// Given lower height, metres.
        min_height: f64,
        /// Given upper height, metres.
        max_height: f64,
    },
    /// A projection with more cells than [`OccupancyGrid::MAX_CELLS`](crate::OccupancyGrid::MAX_CELLS).
    #[error("a grid of {width} x {height} cells is larger than 2^28 cells")]
    GridSize {
        /// Cells along x.
        width: u64,
        /// Cells along y.
        height: u64,
    },
    /// A region of a grid that is not finite, or ends before it begins.
    #[error("no grid from {min:?} to {max:?} m: not finite, or it ends before it begins")]
    GridRegion {
        /// Given lower corner, metres.
        min: [f64; 2],
        /// Given upper corner, metres.
        max: [f64; 2],
    },
    /// An update of a grid by an octree whose cells have another size.
    #[error("a grid of {resolution} m cells cannot be updated by an octree of {other} m cells")]
    GridResolution {
        /// Cell size of the grid, metres.
        resolution: f64,
        /// Cell size of the octree, metres.
        other: f64,
    },
    /// A margin around obstacles that is negative or not finite.
    #[error("obstacles cannot be inflated by {radius} m")]
    Inflation {
        /// Given radius, metres.
        radius: f64,
    },
    /// An update of an inflated grid: the margin around obstacles would be lost.
    #[error("an inflated grid cannot be updated: update the grid that was inflated, and inflate it again")]
    Inflated,
    /// A greatest distance of a [`DistanceField`](crate::DistanceField) that is not positive.
    #[error("no distance field up to {max_distance} m: not positive")]
    MaxDistance {
        /// Given greatest distance, metres.
        max_distance: f64,
    },
    /// A region that is not finite or ends before it begins, or that is too large or too far out for a
    /// [`DistanceField`](crate::DistanceField) with what is within the greatest distance.
    #[error(
        "no distance field from {min:?} to {max:?} m and {max_distance} m around: not finite, it ends before it \
         begins, or it is too large or too far out"
    )]
    Region {
        /// Given lower corner, metres.
        min: [f64; 3],
        /// Given upper corner, metres.
        max: [f64; 3],
        /// Given greatest distance, metres.
        max_distance: f64,
    },
    /// A file that is no octree file, or one that is damaged.
    #[error("no valid octree file: {0}")]
    Malformed(String),
    /// A file of a kind of octree that is not supported.
    #[error("octrees with the id {0:?} are not supported, only OcTree and ColorOcTree")]
    UnsupportedTree(String),
    /// A file that is no map as `map_server` reads them, or one that is damaged.
    #[error("no valid map: {0}")]
    MapFile(String),
    /// Any other error about a file.
    #[error("{path}: {source}")]
    File {
        /// The file's path.
        path: String,
        /// Why it was refused.
        source: Box<Self>,
    },
    /// Reading or writing failed.
    #[error("{path}{source}")]
    Io {
        /// The file's path followed by ": ", or nothing when a stream was read.
        path: String,
        /// What went wrong.
        source: std::io::Error,
    },
}

impl From<std::io::Error> for Error {
    fn from(source: std::io::Error) -> Self {
        Self::Io { path: String::new(), source }
    }
}

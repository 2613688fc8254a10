use dymlm_core::{ConfigError, FrameId, ObjectId};

/// Why a frame or a config was refused. A refused frame changes nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field of the config is outside its range, in the facade's own part or the sensor's. The other parts'
    /// fields are refused by their own crates, through the variants below.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The sensor's stride leaves too little of the frame: a focal length below 0.001 pixels.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// Refused by the preprocessing: a time that runs backwards, an instance mask of the wrong size.
    #[error(transparent)]
    Dynamics(#[from] dymlm_dynamics::Error),
    /// Refused by the cloud: a camera out of its reach.
    #[error(transparent)]
    Cloud(#[from] dymlm_cloud::Error),
    /// No floor is known under a position.
    #[error("no floor is known under {at:?}, seen along up = {up:?}")]
    NoFloor {
        /// The position, metres, world.
        at: [f64; 3],
        /// The given direction.
        up: [f64; 3],
    },
    /// Refused by the octree: a frame or scan whose rays would pass too many cells, or a grid that is empty or
    /// too large.
    #[error(transparent)]
    Octree(#[from] dymlm_octree::Error),
    /// Refused by the plane map: a camera out of its reach.
    #[error(transparent)]
    Planes(#[from] dymlm_planes::Error),
    /// Refused by the object tracker: a frame without colours, an object that is not seen.
    #[error(transparent)]
    Tracking(#[from] dymlm_tracking::Error),
    /// No object of this id is in the map.
    #[error("no object {object} in the map")]
    UnknownObject {
        /// The id asked for.
        object: ObjectId,
    },
    /// No detections of this frame are awaited: it was never inserted as pending, has them already, or was
    /// processed without them because they came too late.
    #[error("frame {frame} awaits no detections")]
    NotPending {
        /// The frame named.
        frame: FrameId,
    },
    /// Refused by the object map: a camera out of its reach.
    #[error(transparent)]
    Objects(#[from] dymlm_objects::Error),
    /// Parts of the cloud cannot be written to the file of [`MemoryConfig`](crate::MemoryConfig): then the
    /// maps are still complete. Or parts cannot be read back: then they are lost, and each further frame is
    /// refused.
    #[error("the file for parts of the cloud that do not fit into memory: {0}")]
    Paging(#[source] std::io::Error),
    /// Key-frame observations could not be kept or read.
    #[error(transparent)]
    History(#[from] dymlm_history::Error),
    /// No observations of key frames are kept, so none can be mapped again.
    #[error("no key-frame observations are kept: set the config's history to memory or to a folder")]
    NoHistory,
    /// No frame of this id was inserted.
    #[error("frame {frame} was never inserted")]
    UnknownFrame {
        /// The frame named.
        frame: FrameId,
    },
    /// A map folder could not be read or written.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Files(#[from] dymlm_io::Error),
    /// The saved state of a session is damaged.
    #[cfg(feature = "io")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
    /// The config that a map was saved with cannot be read.
    #[cfg(feature = "io")]
    #[error("the config of the saved map: {0}")]
    SavedConfig(String),
    /// A path of the config is not UTF-8: the config is saved with the maps, as text.
    #[cfg(feature = "io")]
    #[error("{field} = {path:?} is not UTF-8: the config is saved with the maps, as text")]
    PathNotUtf8 {
        /// The config's field.
        field: &'static str,
        /// The path.
        path: std::path::PathBuf,
    },
    /// Maps that were made with different configs do not merge.
    #[error("the maps were made with different configs: {what}{}", both(*.values))]
    ConfigsDiffer {
        /// The field, or the part of the config, that differs.
        what: &'static str,
        /// Its value in the map that was to be merged into, and in the other map, where it is a number.
        values: Option<[f64; 2]>,
    },
    /// Both maps hold a session, but with different contents.
    #[error(
        "the session that begins with frame {own} ({other} in the other map) is not the same in both maps"
    )]
    SessionsDiffer {
        /// Its first frame in the map that was to be merged into.
        own: FrameId,
        /// Its first frame in the other.
        other: FrameId,
    },
    /// Poses cannot be refined.
    #[cfg(feature = "refine")]
    #[error("the poses cannot be refined: {0}")]
    Refinement(#[from] dymlm_refine::Error),
    /// A loop closure ties key frames, and the maps have none.
    #[cfg(feature = "refine")]
    #[error("a loop closure ties key frames, and no key frame is in the maps")]
    NoKeyFrames,
    /// A standard deviation of a loop closure is not positive, or too small to be squared.
    #[cfg(feature = "refine")]
    #[error(
        "loop closure {closure}: deviations must be positive, not {rotation} (rotation) and {translation}"
    )]
    LoopClosureDeviations {
        /// The closure, by its place in the list.
        closure: usize,
        /// That of the rotation, radians.
        rotation: f64,
        /// That of the translation, metres.
        translation: f64,
    },
    /// A further round of refining the poses has failed. The maps are as the rounds before it have made them.
    #[cfg(feature = "refine")]
    #[error("the poses cannot be refined further: {source}")]
    RefinementStopped {
        /// Why it has failed.
        source: Box<Error>,
        /// What the rounds before it have done.
        done: Box<crate::RefineReport>,
    },
    /// The caller's `watch` has cancelled the correction.
    #[error("the correction was cancelled")]
    Cancelled,
}

fn both(values: Option<[f64; 2]>) -> String {
    values.map_or_else(String::new, |[own, other]| format!(" is {own} and {other}"))
}

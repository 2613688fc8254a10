//! Turns errors of Rust into exceptions of Python with the same text.

use std::error::Error as RustError;

use dymlm::core::ConfigError as FieldError;
use dymlm::{cloud, dynamics, history, objects, octree, planes, tracking};
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::correction::PyRefineReport;

create_exception!(
    dymlm,
    Error,
    PyValueError,
    "A call was refused, such as one with a bad frame, config or folder; the text says why. Nothing has changed."
);
create_exception!(dymlm, ConfigError, Error, "A setting has no such name, or is outside its range.");
create_exception!(dymlm, TimeReversed, Error, "A frame is older than the one before it.");
create_exception!(dymlm, OutOfReach, Error, "A camera or its readings lie too far out to be mapped.");
create_exception!(
    dymlm,
    NotPending,
    Error,
    "A frame awaits no detections: it has them, or was processed without them since they came too late."
);
create_exception!(dymlm, UnknownFrame, Error, "No frame of this id or timestamp was inserted.");
create_exception!(dymlm, UnknownObject, Error, "No object of this id is in the map.");
create_exception!(
    dymlm,
    NoHistory,
    Error,
    "No key frames are kept, so that poses cannot be corrected: see the setting `history`."
);
create_exception!(dymlm, NoFloor, Error, "No floor is known under a place.");
create_exception!(
    dymlm,
    MergeRefused,
    Error,
    "Maps that were made with different configs, or that hold different contents of one session."
);
create_exception!(dymlm, FileError, Error, "A file or folder cannot be read or written, or is damaged.");
create_exception!(dymlm, Locked, FileError, "Somebody else writes the folder of a map.");
create_exception!(
    dymlm,
    RefinementStopped,
    Error,
    "A further round of refining poses has failed. The maps are as the rounds before it have made them; `done`, a \
    RefineReport, says what these have done."
);

/// Raises the error of a result.
pub(crate) trait OrRaise<T> {
    /// The value, or an exception with the error's text.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: RustError + 'static> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(|error| raised(&error))
    }
}

/// An exception with this text.
pub(crate) fn refused(words: impl Into<String>) -> PyErr {
    Error::new_err(words.into())
}

/// An exception for a frame that was named, but never inserted.
pub(crate) fn unknown_frame(words: String) -> PyErr {
    UnknownFrame::new_err(words)
}

/// An exception for a setting.
pub(crate) fn refused_setting(words: impl Into<String>) -> PyErr {
    ConfigError::new_err(words.into())
}

/// The exception for refining that has failed, with what was done before.
pub(crate) fn stopped(py: Python<'_>, error: dymlm::Error) -> PyErr {
    let words = error.to_string();
    let dymlm::Error::RefinementStopped { done, .. } = error else { return raised(&error) };
    let exception = RefinementStopped::new_err(words);
    let report = PyRefineReport::of(*done);
    match exception.value(py).setattr("done", report) {
        Ok(()) => exception,
        Err(error) => error,
    }
}

/// What Python programs tell apart.
#[derive(Clone, Copy)]
enum Kind {
    Config,
    TimeReversed,
    OutOfReach,
    NotPending,
    UnknownFrame,
    UnknownObject,
    NoHistory,
    NoFloor,
    MergeRefused,
    File,
    Locked,
    Other,
}

fn raised(error: &(dyn RustError + 'static)) -> PyErr {
    let words = error.to_string();
    match kind(error) {
        Kind::Config => ConfigError::new_err(words),
        Kind::TimeReversed => TimeReversed::new_err(words),
        Kind::OutOfReach => OutOfReach::new_err(words),
        Kind::NotPending => NotPending::new_err(words),
        Kind::UnknownFrame => UnknownFrame::new_err(words),
        Kind::UnknownObject => UnknownObject::new_err(words),
        Kind::NoHistory => NoHistory::new_err(words),
        Kind::NoFloor => NoFloor::new_err(words),
        Kind::MergeRefused => MergeRefused::new_err(words),
        Kind::File => FileError::new_err(words),
        Kind::Locked => Locked::new_err(words),
        Kind::Other => Error::new_err(words),
    }
}

fn kind(error: &(dyn RustError + 'static)) -> Kind {
    if let Some(error) = error.downcast_ref::<dymlm::Error>() {
        kind_of_facade(error)
    } else if let Some(error) = error.downcast_ref::<dymlm_io::Error>() {
        match error {
            dymlm_io::Error::Locked { .. } => Kind::Locked,
            dymlm_io::Error::Config(_) => Kind::Config,
            _ => Kind::File,
        }
    } else if let Some(error) = error.downcast_ref::<octree::Error>() {
        match error {
            octree::Error::Config(_) => Kind::Config,
            octree::Error::File { .. } | octree::Error::Io { .. } => Kind::File,
            _ => Kind::Other,
        }
    } else if let Some(error) = error.downcast_ref::<tracking::Error>() {
        match error {
            tracking::Error::TimeReversed { .. } => Kind::TimeReversed,
            tracking::Error::Config(_) => Kind::Config,
            _ => Kind::Other,
        }
    } else if error.is::<FieldError>()
        || error.is::<dymlm::files::ConfigFileError>()
        || error.is::<toml::de::Error>()
    {
        Kind::Config
    } else {
        Kind::Other
    }
}

fn kind_of_facade(error: &dymlm::Error) -> Kind {
    use dymlm::Error as Facade;
    match error {
        Facade::Config(_)
        | Facade::Core(dymlm::core::Error::Config(_))
        | Facade::Dynamics(dynamics::Error::Config(_) | dynamics::Error::UnknownLabel { .. })
        | Facade::Cloud(cloud::Error::Config(_))
        | Facade::Planes(planes::Error::Config(_))
        | Facade::Objects(objects::Error::Config(_))
        | Facade::Refinement(dymlm_refine::Error::Config(_)) => Kind::Config,
        Facade::Dynamics(dynamics::Error::TimeReversed { .. })
        | Facade::Objects(objects::Error::TimeReversed { .. }) => Kind::TimeReversed,
        Facade::Cloud(cloud::Error::OutOfReach { .. })
        | Facade::Planes(planes::Error::OutOfReach { .. })
        | Facade::Objects(objects::Error::OutOfReach { .. }) => Kind::OutOfReach,
        Facade::NotPending { .. } => Kind::NotPending,
        Facade::UnknownFrame { .. } | Facade::History(history::Error::Unknown { .. }) => Kind::UnknownFrame,
        Facade::UnknownObject { .. } => Kind::UnknownObject,
        Facade::NoHistory => Kind::NoHistory,
        Facade::NoFloor { .. } => Kind::NoFloor,
        Facade::ConfigsDiffer { .. } | Facade::SessionsDiffer { .. } => Kind::MergeRefused,
        Facade::History(_) | Facade::Paging(_) | Facade::State(_) | Facade::SavedConfig(_) => Kind::File,
        Facade::Files(error) => kind(error),
        Facade::Octree(error) => kind(error),
        Facade::Tracking(error) => kind(error),
        _ => Kind::Other,
    }
}

//! OctoMap's file formats.

mod bt;
mod header;
mod ot;

use std::io::ErrorKind;

use crate::Error;

/// A file that ends too early is damaged; everything else is a failure to read.
fn read_error(error: std::io::Error) -> Error {
    if error.kind() == ErrorKind::UnexpectedEof {
        Error::Malformed("it ends in the middle of the tree".to_owned())
    } else {
        error.into()
    }
}

/// Names the file in an error.
pub(crate) fn at(path: &std::path::Path) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::Io { source, .. } => Error::Io { path: format!("{}: ", path.display()), source },
        Error::Malformed(what) => Error::Malformed(format!("{}: {what}", path.display())),
        other => other,
    }
}

use std::path::Path;

use tempfile::TempDir;

/// A folder that lives as long as what is given; in memory where the system has such a place, since what is
/// written through to a disk takes most of the time else.
pub(crate) fn memory_folder() -> TempDir {
    let in_memory = Path::new("/dev/shm");
    let folder = tempfile::Builder::new().prefix("dymlm-fuzz-").tempdir_in(in_memory);
    folder.or_else(|_| tempfile::tempdir()).unwrap()
}

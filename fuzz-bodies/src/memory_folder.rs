use std::path::Path;

use tempfile::TempDir;

/// A temporary folder that is removed when the returned value is dropped. It is in memory if the system has
/// such a place, since writing through to a disk would take most of the time.
pub(crate) fn memory_folder() -> TempDir {
    let in_memory = Path::new("/dev/shm");
    let folder = tempfile::Builder::new().prefix("dymlm-fuzz-").tempdir_in(in_memory);
    folder.or_else(|_| tempfile::tempdir()).unwrap()
}

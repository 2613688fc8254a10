use std::path::{Path, PathBuf};

/// A file or folder of the recordings, in the folder that `DYMLM_DATA` names, else in `../shared/data` beside
/// the repository; `None`, and a printed line, when it is not there: the test is then skipped.
#[allow(clippy::print_stdout, reason = "for tests")]
pub fn recording(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let path = std::env::var_os("DYMLM_DATA").map_or_else(beside, PathBuf::from).join(name);
    if path.exists() {
        Some(path)
    } else {
        println!("skipped: {} is not there", path.display());
        None
    }
}

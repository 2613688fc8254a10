//! The examples' programs, which lie beside the tests' own: `cargo test` of the whole package builds them.

use std::path::PathBuf;

/// The path of an example's program; `None`, and a printed line, if it is not built.
pub(crate) fn example_program(name: &str) -> Option<PathBuf> {
    let deps = std::env::current_exe().unwrap();
    let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let program = deps.parent()?.parent()?.join("examples").join(name);
    if !program.exists() {
        println!("skipped: {} is not built; run the whole package's tests", program.display());
        return None;
    }
    Some(program)
}

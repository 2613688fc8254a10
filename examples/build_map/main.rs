//! Maps a recorded sequence, or a synthetic one without arguments, and writes the maps, pictures and a
//! report.
//!
//! `cargo run --release --example build_map -- [--sequence NAME | --dataset DIR | --dataset FILE.mcap [--topics ...]] [--detections FILE]
//! [--trajectory FILE] [--corrections FILE] [--refine] [--config FILE.toml] [--resume MAPDIR] [--every N] [--report] [--mcap FILE] [--out DIR]`

use dymlm_examples::{Failure, build_map};

fn main() -> Result<(), Failure> {
    Ok(build_map(None)?)
}

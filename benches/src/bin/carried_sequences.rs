//! Writes the ten sequences of things carried by a hand for `benches/compare`. `carried.images` has the
//! 640x480 colour images, one after the other. `carried.targets` has rows of sequence, image, `x_min`,
//! `y_min`, `x_max`, `y_max` (f32), where the box surrounds the pixels that show the thing.
//!
//! `cargo run --release -p dymlm-benches --bin carried_sequences -- FOLDER`

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use dymlm_sim::{CameraPath, CarriedObject, Sequence, SequenceConfig};

/// Half the frame rate of `track_object --ten-sequences`.
const RATE: f64 = 15.0;
const FRAMES: usize = 120;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("a folder to write to")?);
    let create = |name: &str| File::create(folder.join(name)).map(BufWriter::new);
    let (mut images, mut targets) = (create("carried.images")?, create("carried.targets")?);
    let mut written = 0;
    for (index, carried) in CarriedObject::ten().into_iter().enumerate() {
        let mut config = SequenceConfig::default();
        config.people = 0;
        config.frame_rate = RATE;
        config.frames = FRAMES;
        config.path = CameraPath::Xyz;
        config.carried = Some(carried);
        for frame in Sequence::new(&config)?.frames() {
            let Some(color) = frame.frame.color() else { continue };
            images.write_all(color.data().as_flattened())?;
            let thing = frame.carried.ok_or("nothing is carried")?;
            if let Some(seen) = frame.visible_things.iter().find(|seen| seen.id == thing.id) {
                let sides: [f32; 4] = seen.bounding_box.into();
                for number in [index as f32, written as f32].into_iter().chain(sides) {
                    targets.write_all(&number.to_le_bytes())?;
                }
            }
            written += 1;
        }
    }
    images.flush()?;
    Ok(targets.flush()?)
}

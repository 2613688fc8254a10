use dymlm_examples::{AnyError, NamedSequence, SequenceSet, every, named_sequences};
use dymlm_sim::{PoseErrorConfig, Sequence, SequenceType};

use crate::Arguments;

/// A sequence that maps are built from.
pub(crate) struct Subject {
    /// Name in tables.
    pub(crate) name: String,
    /// Which set it belongs to: figures are averaged over sets.
    pub(crate) set: SequenceSet,
    /// The sequence.
    pub(crate) sequence: Sequence,
}

impl Subject {
    fn new(named: NamedSequence, every_nth: usize) -> Result<Self, AnyError> {
        let sequence = Sequence::new(&every(named.config, every_nth))?;
        Ok(Self { name: named.name, set: named.set, sequence })
    }
}

/// The eight sequences, the second room, and random rooms.
pub(crate) fn chosen(arguments: &Arguments) -> Result<Vec<Subject>, AnyError> {
    let mut sequences = named_sequences(arguments.random_rooms);
    if let Some(part) = &arguments.only {
        sequences.retain(|sequence| sequence.name.contains(part));
    }
    let subjects = sequences.into_iter().map(|mut named| {
        if arguments.pose_noise {
            named.config.pose_error = PoseErrorConfig::slam();
        }
        Subject::new(named, arguments.every)
    });
    subjects.collect()
}

/// Frames of a quick sequence, 8 s of which every second is taken.
const QUICK_FRAMES: usize = 80;

/// Two short sequences, one of each activity.
pub(crate) fn quick() -> Result<Vec<Subject>, AnyError> {
    let quick = [SequenceType::WalkingHalfSphere, SequenceType::SittingXyz].map(SequenceType::name);
    let sequences = named_sequences(0).into_iter().filter(|named| quick.contains(&named.name.as_str()));
    let subjects = sequences.map(|mut named| {
        named.config.frames = QUICK_FRAMES;
        Subject::new(named, 2)
    });
    subjects.collect()
}

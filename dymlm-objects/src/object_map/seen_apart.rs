use dymlm_core::Birth;

#[cfg(feature = "state")]
use super::counter::MOST_COUNTED;
use super::counter::counted;

/// How often an object was detected together with each of its neighbours of the same label, as two things in
/// one frame. What a detector saw as two things is not one, however well two boxes overlap. Each of the two
/// counts, so that both know whom a merge concerns.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SeenApart {
    /// By ascending birth of the neighbour.
    frames: Vec<(Birth, u32)>,
}

impl SeenApart {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.frames.is_sorted_by(|a, b| a.0 < b.0)
            && self.frames.iter().all(|(_, frames)| *frames <= MOST_COUNTED)
    }

    /// Counts one more frame with a neighbour.
    pub(crate) fn note(&mut self, neighbour: Birth) {
        self.add(neighbour, 1);
    }

    /// The frames with a neighbour.
    pub(crate) fn frames_with(&self, neighbour: Birth) -> u32 {
        let place = self.frames.binary_search_by_key(&neighbour, |(birth, _)| *birth);
        place.map_or(0, |place| self.frames[place].1)
    }

    /// The neighbours.
    pub(crate) fn neighbours(&self) -> impl Iterator<Item = Birth> {
        self.frames.iter().map(|(birth, _)| *birth)
    }

    /// Adds the frames of an object that is merged into the one that counts here.
    pub(crate) fn merge(&mut self, other: &Self, [own, merged]: [Birth; 2]) {
        let others = other.frames.iter().filter(|(birth, _)| *birth != own);
        others.for_each(|(birth, frames)| self.add(*birth, *frames));
        self.frames.retain(|(birth, _)| *birth != merged);
    }

    /// Counts the frames with a neighbour that was merged into another for that one.
    pub(crate) fn rename(&mut self, merged: Birth, into: Birth) {
        let frames = self.frames_with(merged);
        self.frames.retain(|(birth, _)| *birth != merged);
        self.add(into, frames);
    }

    /// Forgets a neighbour, which is no longer in the map.
    pub(crate) fn forget(&mut self, neighbour: Birth) {
        self.frames.retain(|(birth, _)| *birth != neighbour);
    }

    /// Bytes that the list owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.frames.capacity() * size_of::<(Birth, u32)>()
    }

    fn add(&mut self, neighbour: Birth, frames: u32) {
        match self.frames.binary_search_by_key(&neighbour, |(birth, _)| *birth) {
            Ok(place) => self.frames[place].1 = counted(self.frames[place].1, frames),
            Err(place) => self.frames.insert(place, (neighbour, frames)),
        }
    }
}

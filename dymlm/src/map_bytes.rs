use dymlm_core::Pages;

use crate::MultiLevelMap;
use crate::session_log::Event;

/// Frames from one count of a map to the next: as many as the cloud's pager lets pass before it asks.
const INTERVAL: usize = 16;

/// Bytes of maps but for the cloud's, counted one map a frame and what is new of the log: a count of all at
/// once would be a pause that grows with the maps, and with the hours.
#[derive(Debug, Default)]
pub(crate) struct MapBytes {
    /// Frames since the interval began.
    frames: usize,
    octree: usize,
    planes: usize,
    objects: usize,
    log: usize,
    events: EventBytes,
}

impl MapBytes {
    /// Must be called once a frame.
    pub(crate) fn go_on(&mut self, map: &MultiLevelMap) {
        match self.frames {
            4 => self.octree = map.octree.memory_bytes(),
            8 => self.planes = map.planes.memory_bytes(),
            12 => self.objects = map.objects.map().memory_bytes(),
            15 => {
                let log = map.past.log.as_ref();
                let bytes = log.map(|log| {
                    log.history.memory_bytes() + log.frames.memory_bytes() + self.events.count(&log.events)
                });
                self.log = bytes.unwrap_or(0);
            }
            _ => {}
        }
        self.frames = (self.frames + 1) % INTERVAL;
    }

    /// As they were counted last; right in the last call of each 16.
    pub(crate) fn total(&self) -> usize {
        self.octree + self.planes + self.objects + self.log
    }
}

/// Bytes of a list of events, which is counted as it grows.
#[derive(Debug, Default)]
struct EventBytes {
    /// How many have been counted, and what they own.
    counted: usize,
    owned: usize,
}

impl EventBytes {
    fn count(&mut self, events: &Pages<Event>) -> usize {
        if events.len() < self.counted {
            // Frames were removed.
            *self = Self::default();
        }
        self.owned += events.iter_from(self.counted).map(Event::memory_bytes).sum::<usize>();
        self.counted = events.len();
        events.memory_bytes() + self.owned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random_session::{FRAMES, Session, Step};

    #[test]
    fn what_is_counted_as_it_comes_is_what_a_count_of_all_gives() {
        let steps = vec![Step::Frame { is_detector_run: true }; FRAMES];
        let mut session = Session::new();
        let mut bytes = MapBytes::default();
        let mut go_on = |session: &mut Session, steps: &[Step]| {
            for step in steps {
                session.take(step);
            }
            // What is still being packed comes later.
            session.builder.map.past.log.as_mut().unwrap().history.settle();
            for _ in 0..INTERVAL {
                bytes.go_on(session.builder.map());
            }
            let memory = session.builder.map().memory();
            assert_eq!(bytes.total(), memory.octree + memory.planes + memory.objects + memory.history);
        };
        go_on(&mut session, &steps[..9]);
        go_on(&mut session, &steps[9..]);
        go_on(&mut session, &[Step::Remove { which: 3 }, Step::Settle, Step::Remove { which: 4 }]);
    }
}

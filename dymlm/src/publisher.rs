use crate::{MapReader, MultiLevelMap};

/// Publishes maps to readers at regular intervals.
#[derive(Debug, Default)]
pub(crate) struct Publisher {
    /// The reader that the others are clones of; none before the first.
    reader: Option<MapReader>,
    /// Time of the last publication, seconds of the frames' clock.
    last: Option<f64>,
}

impl Publisher {
    /// A reader of the maps as they are now, and of those that will be published.
    pub(crate) fn reader(&mut self, map: &mut MultiLevelMap) -> MapReader {
        if let Some(reader) = &self.reader {
            let reader = reader.clone();
            self.publish(map);
            return reader;
        }
        self.reader.insert(MapReader::new(map.clone())).clone()
    }

    /// Publishes when `interval` seconds have passed since the last time, and anybody reads.
    pub(crate) fn publish_when_due(&mut self, timestamp: f64, interval: f64, map: &mut MultiLevelMap) {
        if self.last.is_none_or(|last| timestamp - last >= interval) && self.publish(map) {
            self.last = Some(timestamp);
        }
    }

    /// Approximate bytes that the published maps hold besides what they share with the maps.
    pub(crate) fn memory_bytes(&self, map: &MultiLevelMap) -> usize {
        self.reader.as_ref().map_or(0, |reader| reader.latest().memory_beside(map).total())
    }

    /// Whether frames have come since maps were published last; no map need have seen them.
    pub(crate) fn lacks_frames_of(&self, map: &MultiLevelMap) -> bool {
        self.reader.as_ref().is_some_and(|reader| reader.latest().past.frames != map.past.frames)
    }

    /// Publishes the maps if anybody reads; returns whether it did. Costs a pointer for each plane, key frame
    /// and object, and for each 64 blocks of the cloud.
    pub(crate) fn publish(&mut self, map: &mut MultiLevelMap) -> bool {
        let Some(reader) = &self.reader else { return false };
        if !reader.is_shared() {
            // Nobody reads any more: the maps published last would hold their own copy of whatever changes.
            self.reader = None;
            return false;
        }
        // The static cloud that a reader has worked out need not be worked out again.
        map.cloud.adopt_static(&reader.latest().cloud);
        reader.publish(map.clone());
        true
    }
}

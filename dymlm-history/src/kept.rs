use std::sync::Arc;

use dymlm_core::Point;

use crate::Observation;
use crate::packing::{pack, unpack};
use crate::packing_buffers::PackingBuffers;
use crate::scan_code::{pack_scan, unpack_scan};

/// What a history keeps.
#[derive(Debug, Clone)]
pub(crate) enum Kept {
    Observation(Arc<Observation>),
    /// Points in the sensor's frame, metres.
    Scan(Arc<[Point]>),
}

/// The last byte of packed data gives its kind.
const OBSERVATION: u8 = 0;
const SCAN: u8 = 1;

impl Kept {
    pub(crate) fn pack(&self, buffers: &mut PackingBuffers) -> Box<[u8]> {
        let (mut packed, kind) = match self {
            Self::Observation(observation) => (pack(observation, buffers), OBSERVATION),
            Self::Scan(points) => (pack_scan(points), SCAN),
        };
        packed.push(kind);
        packed.into_boxed_slice()
    }

    /// Reads what was packed; `None` when it is damaged.
    pub(crate) fn unpack(packed: &[u8]) -> Option<Self> {
        match packed.split_last()? {
            (&OBSERVATION, packed) => Some(Self::Observation(Arc::new(unpack(packed)?))),
            (&SCAN, packed) => Some(Self::Scan(unpack_scan(packed)?.into())),
            _ => None,
        }
    }
}

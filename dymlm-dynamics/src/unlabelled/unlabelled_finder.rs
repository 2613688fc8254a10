use dymlm_core::{Detection, Frame, Mask, Pose, SensorModel};

use super::FreeSpace;
use super::new_surface::NewSurfaces;
use crate::{BoxTracker, Error, TrackedBox, TrackerConfig, View};

/// Finds what moves and is reported by no detector, and follows it from frame to frame.
#[derive(Debug)]
pub(crate) struct UnlabelledFinder {
    sensor: SensorModel,
    surfaces: NewSurfaces,
    tracker: BoxTracker,
    found: Vec<Detection>,
}

impl UnlabelledFinder {
    pub(crate) fn new(config: TrackerConfig, sensor: SensorModel) -> Result<Self, Error> {
        let tracker = BoxTracker::new(config)?;
        Ok(Self { sensor, surfaces: NewSurfaces::default(), tracker, found: Vec::new() })
    }

    /// The boxes of new surfaces among a frame's static pixels, by ascending track id. `labelled` tracks the
    /// movers that have a label: no id is used twice.
    pub(crate) fn find<'a>(
        &'a mut self,
        frame: &Frame,
        static_mask: &Mask,
        world_from_camera: &Pose,
        free_space: &dyn FreeSpace,
        labelled: &mut BoxTracker,
    ) -> Result<impl Iterator<Item = &'a TrackedBox> + use<'a>, Error> {
        let boxes = self.surfaces.find(frame, static_mask, world_from_camera, &self.sensor, free_space);
        self.found.clear();
        for &bounding_box in boxes {
            self.found.push(Detection::new("", 1.0, bounding_box)?);
        }
        let view = View { camera: *frame.camera(), world_from_camera: *world_from_camera };
        self.tracker.continue_ids_of(labelled);
        self.tracker.update(frame.timestamp(), &self.found, Some(&view))?;
        labelled.continue_ids_of(&self.tracker);
        // Where nothing new is read any more, there is nothing to mask.
        Ok(self.tracker.boxes().iter().filter(|tracked| tracked.is_detected()))
    }
}

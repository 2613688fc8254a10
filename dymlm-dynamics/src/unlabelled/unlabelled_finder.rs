use dymlm_core::{BoundingBox, Detection, Frame, Mask, Pose, SensorModel, TrackId};

use super::FreeSpace;
use super::new_surface::NewSurfaces;
use crate::{
    BoxCorrector, BoxSource, BoxTracker, Error, Foreground, ForegroundFinder, MaskRegion, Mover,
    StaticMaskBuilder, TrackerConfig, View,
};

/// How often the box of a new surface is widened to the thing of which it is a part. Each time adds what is
/// joined to it within the margin of the search; a thing that fills half of the image needs three.
const MAX_WIDENINGS: usize = 3;

/// Finds movers that no detector reports, and tracks them from frame to frame.
///
/// A surface in space that was free for long is new. What is joined to it is part of the same thing, even
/// where the space was never observed. So the thing is cut out as a detected mover is, by clustering the
/// readings in its box; the clusters of which a good part is new are taken.
#[derive(Debug)]
pub(crate) struct UnlabelledFinder {
    sensor: SensorModel,
    surfaces: NewSurfaces,
    tracker: BoxTracker,
    foreground: Foreground,
    found: Vec<Detection>,
    corrected: Vec<(BoundingBox, Option<f32>)>,
    /// Of the tracks that were found in the last frame.
    depths: Vec<(TrackId, f32)>,
}

/// The steps by which any mover is cut out.
pub(crate) struct Cutting<'a> {
    pub(crate) finder: &'a mut ForegroundFinder,
    pub(crate) corrector: &'a mut BoxCorrector,
    pub(crate) mask_builder: &'a mut StaticMaskBuilder,
}

impl UnlabelledFinder {
    pub(crate) fn new(config: TrackerConfig, sensor: SensorModel) -> Result<Self, Error> {
        Ok(Self {
            sensor,
            surfaces: NewSurfaces::default(),
            tracker: BoxTracker::new(config)?,
            foreground: Foreground::default(),
            found: Vec::new(),
            corrected: Vec::new(),
            depths: Vec::new(),
        })
    }

    /// Converts the stored pose after the world frame was moved.
    pub(crate) fn move_world(&mut self, new_from_old: &Pose) {
        self.tracker.move_world(new_from_old);
    }

    /// Makes the pixels of new things `false` in the mask of static pixels.
    pub(crate) fn mask(
        &mut self,
        frame: &Frame,
        world_from_camera: &Pose,
        free_space: &dyn FreeSpace,
        cutting: &mut Cutting<'_>,
        static_mask: &mut Mask,
    ) -> Result<(), Error> {
        let Self { surfaces, foreground, found, corrected, .. } = self;
        let was_free =
            |place, margin| free_space.is_long_free(world_from_camera.transform_point(place), margin);
        surfaces.find(frame, static_mask, &self.sensor, was_free);
        found.clear();
        corrected.clear();
        let is_new = |place| was_free(place, 0.0);
        for surface in surfaces.surfaces() {
            // It may belong to a larger thing that is already masked.
            if !surfaces.is_static(surface, static_mask) {
                continue;
            }
            let mut searched = surface.bounding_box;
            cutting.finder.find_new(frame, searched, static_mask, is_new, foreground);
            for _ in 0..MAX_WIDENINGS {
                match foreground.bounding_box().filter(|found| found.area() > searched.area()) {
                    Some(found) => searched = found,
                    None => break,
                }
                cutting.finder.find_new(frame, searched, static_mask, is_new, foreground);
            }
            if foreground.is_empty() {
                // Most of the wider thing was there before, so only the surface itself is searched.
                cutting.finder.find_new(frame, surface.bounding_box, static_mask, is_new, foreground);
            }
            let Some(bounding_box) = foreground.bounding_box() else { continue };
            let corrected_box = cutting.corrector.correct(frame, &bounding_box, foreground);
            let region =
                MaskRegion { bounding_box: corrected_box, sure_box: None, foreground, instance_mask: None };
            cutting.mask_builder.mask(&region, frame, static_mask);
            found.push(Detection::new("", 1.0, bounding_box)?);
            corrected.push((corrected_box, foreground.depth()));
        }
        Ok(())
    }

    /// Adds the masked things to the movers. `labelled` is the tracker of the movers that have a label; no id
    /// is used twice.
    pub(crate) fn track(
        &mut self,
        frame: &Frame,
        world_from_camera: &Pose,
        labelled: &mut BoxTracker,
        movers: &mut Vec<Mover>,
    ) -> Result<(), Error> {
        let view = View { camera: *frame.camera(), world_from_camera: *world_from_camera };
        self.tracker.continue_ids_of(labelled);
        let boxes = self.tracker.update(frame.timestamp(), &self.found, Some(&view))?;
        self.depths.clear();
        for tracked in boxes {
            // Predicted boxes are not reported: nothing new is read there.
            let BoxSource::Detected { detection } = tracked.source else { continue };
            let Some(&(corrected_box, depth)) = self.corrected.get(detection) else { continue };
            self.depths.extend(depth.map(|depth| (tracked.track_id, depth)));
            let source = BoxSource::FreeSpace;
            movers.push(Mover { label: None, source, corrected_box, depth, ..Mover::of_track(tracked) });
        }
        for &(track_id, depth) in &self.depths {
            self.tracker.observe_depth(track_id, depth);
        }
        labelled.continue_ids_of(&self.tracker);
        Ok(())
    }
}

use dymlm_core::{Frame, Mask, PinholeCamera, Pose, SensorModel, Visibility};

use crate::block_depths::BlockDepths;
use crate::surroundings::Surroundings;

/// Age at which the view in each slot moves on to the next slot, seconds. Closely spaced views see both ends
/// of a person's sway, old ones see that somebody has shifted in the seat. (Without the views between:
/// residue of `fresh_90417_sitting_0` .35 to .68 %.)
const AGES: [f64; 8] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 16.0, 32.0];
/// Age at which a view is forgotten even if no newer one has taken its place, as after a pause, seconds. The
/// oldest slot moves on at its age, when the next view is stored.
const MAX_AGE: f64 = AGES[AGES.len() - 1] + AGES[0];

/// Accuracy of poses and of places interpolated between readings, metres. A lower value takes pose errors for
/// motion, a higher one misses the sway of somebody near the camera.
pub(crate) const EVENNESS: f64 = 0.004;
/// Time over which a part must be known to have been still, seconds. A lower value takes a thigh that rests
/// between two movements for a part of the chair, a higher one keeps chairs out of the map for longer
/// (`as_long_as_nothing_has_moved_all_is_the_movers`).
pub(crate) const WATCHED: f64 = 4.0;
/// Largest difference of depth at which a block has not moved, as a share of a reading's tolerance: one
/// standard deviation of a single reading, several of a block's mean. A lower value takes noise for motion, a
/// higher one takes a sway of 2 cm for noise (`a_seat_is_static_while_who_sits_on_it_sways`).
const OFF: f64 = 1.0 / 3.0;

/// Coarse depth images of the last half minute, with the poses from which they were taken.
///
/// After half a minute nothing more is allocated.
#[derive(Debug, Default)]
pub(crate) struct PastViews {
    /// Sorted by age, the newest first.
    views: Vec<PastView>,
    surroundings: Surroundings,
}

/// One coarse depth image, its camera and pose.
#[derive(Debug)]
pub(crate) struct PastView {
    timestamp: f64,
    camera: PinholeCamera,
    camera_from_world: Pose,
    blocks: BlockDepths,
    /// Error of the poses between the view and the present frame, metres.
    misfit: f64,
}

impl PastViews {
    /// The views, the oldest first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &PastView> {
        self.views.iter().rev()
    }

    /// Whether a view has looked through a place (world, metres).
    pub(crate) fn have_looked_through(&self, place: [f64; 3], sensor: &SensorModel) -> bool {
        self.views.iter().any(|view| {
            let in_view = view.camera_from_world.transform_point(place);
            let tolerance = sensor.tolerance(in_view[2] as f32, 0.0);
            let reading = view.reading_of(in_view, tolerance).unwrap_or(0.0);
            Visibility::of_reading(reading, in_view[2], tolerance) == Visibility::Absent
        })
    }

    /// Converts the stored poses after the world frame was moved.
    pub(crate) fn move_world(&mut self, new_from_old: &Pose) {
        let old_from_new = new_from_old.inverse();
        for view in &mut self.views {
            view.camera_from_world = view.camera_from_world * old_from_new;
        }
    }

    /// Forgets what is too old at a time: poses have drifted and things were moved since.
    pub(crate) fn forget_old(&mut self, now: f64) {
        self.views.retain(|view| view.age(now) <= MAX_AGE);
    }

    /// Measures how well each view fits a frame: the typical distance between what both read outside of the
    /// movers' boxes, which is the error of the poses between the two.
    pub(crate) fn measure_misfits(
        &mut self,
        frame: &Frame,
        world_from_camera: &Pose,
        boxes: &Mask,
        sensor: &SensorModel,
    ) {
        self.surroundings.read(frame, boxes, sensor);
        for view in &mut self.views {
            view.misfit = self.surroundings.misfit(view, &view.view_from(world_from_camera), sensor);
        }
    }

    /// Stores a frame when the newest view is old enough.
    pub(crate) fn remember(&mut self, frame: &Frame, world_from_camera: &Pose, sensor: &SensorModel) {
        let now = frame.timestamp();
        let stays = |view: &PastView, age: f64| now - view.timestamp < age;
        if self.views.first().is_some_and(|view| stays(view, AGES[0])) {
            return;
        }
        // All views before the first that stays move on by one slot; the last of them is dropped.
        let due = self.views.iter().zip(AGES).take_while(|&(view, age)| !stays(view, age)).count();
        let makes_room = due < self.views.len() || due == AGES.len();
        let mut blocks = if makes_room { self.views.remove(due - 1).blocks } else { BlockDepths::default() };
        let (depth, camera) = (frame.depth(), *frame.camera());
        blocks.fill(depth, camera.size_scale(), sensor, [0..depth.width(), 0..depth.height()], |_, _| true);
        let camera_from_world = world_from_camera.inverse();
        let misfit = f64::INFINITY;
        self.views.insert(0, PastView { timestamp: now, camera, camera_from_world, blocks, misfit });
    }
}

impl PastView {
    /// Seconds from the view to a time.
    pub(crate) fn age(&self, timestamp: f64) -> f64 {
        timestamp - self.timestamp
    }

    /// The [measured](PastViews::measure_misfits) error of the poses between the view and the present frame,
    /// metres; infinite when it is not known.
    pub(crate) fn misfit(&self) -> f64 {
        self.misfit
    }

    /// The transformation from another camera's frame to the view's.
    pub(crate) fn view_from(&self, world_from_camera: &Pose) -> Pose {
        self.camera_from_world * *world_from_camera
    }

    /// Whether a surface that is read at a place (in the view's frame) was not there in the view; `None` when
    /// the view cannot tell.
    pub(crate) fn has_moved(&self, place: [f64; 3], sensor: &SensorModel) -> Option<bool> {
        let limit = OFF * sensor.tolerance(place[2] as f32, EVENNESS);
        self.displacement(place, sensor).map(|displacement| displacement.abs() > limit)
    }

    /// How far behind a place (in the view's frame, metres) the view has read a surface: infinite when it has
    /// looked through the place, `None` when it cannot tell.
    pub(crate) fn displacement(&self, place: [f64; 3], sensor: &SensorModel) -> Option<f64> {
        let tolerance = sensor.tolerance(place[2] as f32, EVENNESS);
        let reading = self.reading_of(place, tolerance)?;
        match Visibility::of_reading(reading, place[2], tolerance) {
            Visibility::Present => Some(reading - place[2]),
            Visibility::Absent => Some(f64::INFINITY),
            Visibility::OutOfView | Visibility::NoReading | Visibility::Occluded => None,
        }
    }

    /// The reading at a place in the view's frame, 0 = no reading; `None` when the place is out of view.
    /// Readings that agree within the tolerance are interpolated.
    pub(crate) fn reading_of(&self, place: [f64; 3], tolerance: f64) -> Option<f64> {
        let pixel = self.camera.project(place).filter(|&pixel| self.camera.sees(pixel))?;
        Some(self.blocks.reading(pixel, place[2], tolerance))
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::DepthImage;

    use super::*;

    fn remember(past: &mut PastViews, now: f64) {
        let camera = PinholeCamera::new(8, 8, 8.0, 8.0, 3.5, 3.5).unwrap();
        let depth = DepthImage::new(8, 8, vec![1.0; 64]).unwrap();
        let frame = Frame::new(now, camera, depth, None).unwrap();
        past.forget_old(now);
        past.remember(&frame, &Pose::identity(), &SensorModel::kinect());
    }

    #[test]
    fn a_pause_leaves_no_view_from_before_it() {
        let mut past = PastViews::default();
        (0..40).for_each(|second| remember(&mut past, f64::from(second)));
        assert_eq!(past.iter().count(), AGES.len());
        remember(&mut past, 60.0);
        assert!(past.iter().all(|view| view.age(60.0) <= MAX_AGE));
        assert!(past.iter().count() > 3, "it was a short one");
        remember(&mut past, 3600.0);
        assert_eq!(past.iter().count(), 1);
    }

    #[test]
    fn views_of_every_age_are_kept_whatever_the_frame_rate() {
        for frame_rate in [2.0, 10.0, 60.0] {
            let mut past = PastViews::default();
            for index in 0..(100.0 * frame_rate) as u32 {
                let now = f64::from(index) / frame_rate;
                remember(&mut past, now);
                let ages: Vec<f64> = past.iter().map(|view| view.age(now)).collect();
                assert!(ages.is_sorted_by(|a, b| a > b));
                if now > 50.0 {
                    assert_eq!(ages.len(), AGES.len());
                    assert!((16.0..=33.0).contains(&ages[0]), "{ages:?}");
                    let since = |seconds: f64| ages.iter().filter(|&&age| age <= seconds).count();
                    assert!(since(4.1) >= 4 && since(8.1) >= 6, "{ages:?}");
                }
            }
        }
    }
}

use dymlm_core::{DepthView, SensorModel, Visibility};

use crate::view::PLACE_SIGMA;
use crate::{MapObject, ObjectView};

/// What a frame's depths say of an object that the detector did not find in the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Existence {
    /// The object is out of view or occluded.
    Unknown,
    /// Readings lie where its surface should be.
    Present,
    /// The frame looks through the place where it should be.
    Absent,
}

/// Most points of an object that are checked.
const MAX_POINTS: usize = 64;
/// Compares some of an object's points with the depth image. `Unknown` unless at least half of them are in
/// the image, static and not occluded.
pub(crate) fn judge_existence(view: &ObjectView<'_>, object: &MapObject, sensor: &SensorModel) -> Existence {
    let camera = view.frame.camera();
    let camera_from_world = view.world_from_camera.inverse();
    let depths = DepthView::new(camera, view.frame.depth(), sensor);
    let [mut asked, mut present, mut absent] = [0; 3];
    for place in object.points().step_by(object.point_count().div_ceil(MAX_POINTS).max(1)) {
        asked += 1;
        let place = camera_from_world.transform_point(place);
        let seen = depths.look_at(place, PLACE_SIGMA);
        let [u, v] = seen.pixel;
        if place[2] > sensor.max_depth.into() || !view.is_static(u, v) {
            continue;
        }
        match seen.visibility {
            Visibility::Present => present += 1,
            Visibility::Absent => absent += 1,
            _ => {}
        }
    }
    let answered = present + absent;
    if answered == 0 || 2 * answered < asked {
        Existence::Unknown
    } else if 2 * absent > answered {
        Existence::Absent
    } else {
        Existence::Present
    }
}

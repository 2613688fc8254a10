use dymlm_core::{DepthView, SensorModel, Visibility};

use crate::{MapObject, ObjectView};

/// What a frame's depths say of an object that the detector did not find in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Existence {
    /// It is out of view, or occluded.
    Unknown,
    /// Something is read where it should be.
    Present,
    /// The frame looks through the place where it should be.
    Absent,
}

/// Points of an object that are asked, at most.
const MAX_POINTS: usize = 64;
/// How well an object's points are known where they are, metres, as a standard deviation: errors of poses,
/// and of points that were fused from several sides. Lower removes objects when poses drift, higher keeps low
/// ones whose place is read.
const PLACE_SIGMA: f64 = 0.05 / 3.0;
/// Share of the points asked that must have an answer.
const LEAST_ANSWERED: f64 = 0.6;
/// Share of the answers that must be absent.
const MOSTLY_ABSENT: f64 = 0.6;

/// Projects some of the object's points: most of them must be in the image, static and not occluded for the
/// frame to say anything.
pub(crate) fn judge_existence(view: &ObjectView<'_>, object: &MapObject, sensor: &SensorModel) -> Existence {
    let camera = view.frame.camera();
    let camera_from_world = view.world_from_camera.inverse();
    let depths = DepthView::new(camera, view.frame.depth(), sensor);
    let [mut asked, mut present, mut absent] = [0.0; 3];
    for place in object.points().step_by(object.point_count().div_ceil(MAX_POINTS).max(1)) {
        asked += 1.0;
        let place = camera_from_world.transform_point(place);
        let seen = depths.look_at(place, PLACE_SIGMA);
        let [u, v] = seen.pixel;
        if place[2] > sensor.max_depth.into() || !view.is_static(u, v) {
            continue;
        }
        match seen.visibility {
            Visibility::Present => present += 1.0,
            Visibility::Absent => absent += 1.0,
            _ => {}
        }
    }
    let answered = present + absent;
    if answered == 0.0 || answered < LEAST_ANSWERED * asked {
        Existence::Unknown
    } else if absent > MOSTLY_ABSENT * answered {
        Existence::Absent
    } else {
        Existence::Present
    }
}

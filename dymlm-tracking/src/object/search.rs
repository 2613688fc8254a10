use dymlm_core::vector3::{cross, dot, norm, unit};
use dymlm_core::{BoundingBox, Detection, PinholeCamera, Pose};

use super::fit::Fit;
use super::likely_places::{Place, Wanted};
use super::model::ObjectModel;
use super::pose_fitter::{LEAST_INLIERS, PoseFitter};
use super::scene::Scene;
use super::view_store::ViewStore;
use crate::pose::rotation_about;

/// Largest number of times that images are halved for a search: 2 reaches four times as far.
const HALVINGS_SEARCHED: usize = 2;
/// Attitudes tried per frame besides the last one; they are taken in turn from the nearest stored views.
const ATTITUDES_A_FRAME: usize = 2;
const MOST_VIEWS_SEARCHED: usize = 8;

/// Finds an object again when tracking from its last points has failed.
#[derive(Debug, Clone)]
pub(super) struct Search {
    label: Option<String>,
    /// Number of frames of this search, so that it goes through all attitudes in turn.
    frames: usize,
}

/// The information with which a search begins.
pub(super) struct Clues<'a> {
    pub(super) detections: &'a [Detection],
    /// The last pose, or a prediction from it.
    pub(super) predicted: Pose,
    /// The window tracker's box.
    pub(super) window: BoundingBox,
}

impl Search {
    pub(super) fn new(label: Option<&str>) -> Self {
        Self { label: label.map(str::to_owned), frames: 0 }
    }

    /// The object is found: the next search begins from the start.
    pub(super) fn end(&mut self) {
        self.frames = 0;
    }

    /// Tries some attitudes at the likeliest places.
    pub(super) fn find(
        &mut self,
        scene: Scene<'_>,
        model: &ObjectModel,
        views: &mut ViewStore,
        fitter: &mut PoseFitter,
        clues: &Clues<'_>,
    ) -> Option<Fit> {
        self.frames += 1;
        let last_box = model.bounds_in_image(scene.camera, &clues.predicted);
        let others: Vec<BoundingBox> = std::iter::once(clues.window).chain(last_box).collect();
        let wanted = Wanted { model, label: self.label.as_deref(), camera_from_object: clues.predicted };
        let attitudes = attitudes(views, &clues.predicted);
        // The last attitude is tried in each frame, the others in turn.
        let rest = attitudes.len().saturating_sub(1).max(1);
        let turn = |i: usize| 1 + (ATTITUDES_A_FRAME * self.frames + i) % rest;
        let chosen: Vec<Pose> = std::iter::once(0)
            .chain((0..ATTITUDES_A_FRAME).map(turn))
            .filter_map(|i| attitudes.get(i).copied())
            .collect();
        for place in wanted.places(scene, clues.detections, &others, self.frames - 1) {
            for attitude in &chosen {
                if let Some(start) = placed(scene.camera, attitude, place)
                    && let Some(coarse) = pose_near(scene, views, fitter, &start)
                    && let Some(fit) = fitter.fit(scene, model, views, &coarse, None)
                    && fit.matches.len() >= 2 * LEAST_INLIERS
                {
                    return Some(fit);
                }
            }
        }
        None
    }
}

/// Possible attitudes of a lost object, as poses at any place: the predicted one, then those of the stored
/// views, the nearest first.
fn attitudes(views: &ViewStore, predicted: &Pose) -> Vec<Pose> {
    std::iter::once(*predicted).chain(views.poses(predicted).take(MOST_VIEWS_SEARCHED)).collect()
}

/// A pose near a rough one, found from coarse to fine by matching the points of the view with the nearest
/// direction.
fn pose_near(scene: Scene<'_>, views: &mut ViewStore, fitter: &mut PoseFitter, start: &Pose) -> Option<Pose> {
    let mut found = None;
    // A coarse level only prepares the next one: it may fail.
    for halvings in (0..=HALVINGS_SEARCHED).rev() {
        let matches = views.find_coarsely(scene, start, &found.unwrap_or(*start), halvings);
        found = fitter.agree(scene, &matches, None).or(found.filter(|_| halvings > 0));
    }
    found
}

/// A pose rotated with the viewing ray, so that the object's origin appears at a place with the same side
/// visible.
pub(super) fn placed(camera: &PinholeCamera, pose: &Pose, place: Place) -> Option<Pose> {
    let origin = camera.back_project(place.center.map(f64::from), place.depth);
    // The smallest rotation from the old ray to the new one.
    let [old, new] = [unit(pose.translation())?, unit(origin)?];
    let axis = cross(old, new);
    let turn = unit(axis).map_or_else(Pose::identity, |direction| {
        let angle = norm(axis).atan2(dot(old, new));
        rotation_about(direction.map(|x| x * angle))
    });
    Pose::new(origin, (turn * *pose).quaternion()).ok()
}

#[cfg(test)]
mod tests {
    use dymlm_core::vector3::difference;

    use super::*;

    #[test]
    fn an_object_is_turned_with_the_ray_also_from_behind_the_camera() {
        let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5).unwrap();
        let place = Place { center: [40.0, 20.0], depth: 1.5 };
        for old in [[0.3, 0.1, 1.0], [0.4, -0.1, -0.2], [0.5, 0.0, -2.0]] {
            let pose = Pose::new(old, [0.0, 0.0, 0.6, 0.8]).unwrap();
            let new = placed(&camera, &pose, place).unwrap();
            // The side that was seen is seen: the direction to the camera is the same in the object's frame.
            let [before, after] =
                [pose, new].map(|pose| unit(pose.inverse().rotate(pose.translation())).unwrap());
            assert!(norm(difference(before, after)) < 1e-9, "{old:?}: {before:?} {after:?}");
        }
    }
}

use dymlm_core::axial_noise;
use dymlm_core::vector3::Vector3;

use crate::{MapObject, ObjectView};

/// What a frame says of an object that may be in its view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sighting {
    /// Out of view, or hidden.
    Nothing,
    /// There is something where it should be.
    There,
    /// The frame looks through the place where it should be.
    LookedThrough,
}

/// Tells from depth whether an object is where it should be.
#[derive(Debug, Default)]
pub(crate) struct ExistenceJudge {
    places: Vec<Vector3>,
}

/// Points of an object that are asked, at most.
const MOST: usize = 64;
/// A reading differs from a point's depth when it does so by this and some noise, metres.
const GAP: f32 = 0.05;
/// Share of the points asked that must have an answer.
const LEAST_ANSWERED: f32 = 0.6;

impl ExistenceJudge {
    /// Projects some of the object's points: most of them must be in the image, static and not hidden for the frame to
    /// say anything.
    pub(crate) fn judge(&mut self, view: &ObjectView<'_>, object: &MapObject, max_depth: f32) -> Sighting {
        let camera = view.frame.camera();
        let camera_from_world = view.world_from_camera.inverse();
        let center = camera_from_world.transform_point(object.oriented_box.center());
        if camera.project(center).is_none_or(|pixel| !camera.sees(pixel)) {
            return Sighting::Nothing;
        }
        let step = object.cloud.len().div_ceil(MOST).max(1);
        self.places.clear();
        self.places
            .extend(object.points().step_by(step).map(|place| camera_from_world.transform_point(place)));
        let [mut there, mut through] = [0.0_f32; 2];
        for &place in &self.places {
            let Some(pixel) = camera.project(place).filter(|&pixel| camera.sees(pixel)) else { continue };
            let [u, v] = pixel.map(|c| c.round().max(0.0) as usize);
            let reading = view.frame.depth().at(u, v);
            let z = place[2] as f32;
            if reading <= 0.0 || z > max_depth || !view.is_static(u, v) {
                continue;
            }
            let gap = GAP + 3.0 * axial_noise(z);
            through += f32::from(u8::from(reading > z + gap));
            there += f32::from(u8::from((reading - z).abs() <= gap));
        }
        let answered = there + through;
        if answered < LEAST_ANSWERED * self.places.len() as f32 || self.places.is_empty() {
            Sighting::Nothing
        } else if through > 0.6 * answered {
            Sighting::LookedThrough
        } else {
            Sighting::There
        }
    }
}

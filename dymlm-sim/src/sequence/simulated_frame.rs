use std::ops::RangeBounds;

use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, Mask, Pose};
use dymlm_geometry::OrientedBox;

use crate::SceneEvent;

/// One frame of a [`Sequence`](crate::Sequence) and the truth about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SimulatedFrame {
    /// The camera's output: noisy depth and colour.
    pub frame: Frame,
    /// The detector's output, highest score first.
    pub detections: Vec<Detection>,
    /// The exact pose.
    pub world_from_camera: Pose,
    /// The pose that a SLAM front end estimates ([`PoseErrorConfig`](crate::PoseErrorConfig)): the exact one
    /// by default.
    pub estimated_world_from_camera: Pose,
    /// The exact depth, without range limits.
    pub true_depth: DepthImage,
    /// `true` where the ray through the pixel's centre meets a mover: people, a carried thing, and what an
    /// event has set in motion.
    pub mover_mask: Mask,
    /// `true` where this ray meets something that does not stand there at the end: a mover, or a thing at
    /// rest that an event takes away later. A finished map must hold none of these points.
    pub transient_mask: Mask,
    /// The things in view that have a label, by ascending id.
    pub visible_things: Vec<VisibleThing>,
    /// The exact pose of the thing that a hand carries, if the config asks for one.
    pub carried: Option<CarriedThing>,
    /// Index of the part that each pixel shows; the static parts come first, and any higher index is a moving
    /// part or nothing.
    pub(crate) parts: Vec<u16>,
}

impl SimulatedFrame {
    /// Whether the frame looks through a place that is within range, camera frame: the sensor has a reading on the
    /// ray through it, and the exact surface lies farther behind it than `reach`, metres.
    pub fn looks_through(&self, place: [f64; 3], range: &impl RangeBounds<f64>, reach: f64) -> bool {
        let camera = self.frame.camera();
        let Some(pixel) = camera.project(place).filter(|&pixel| camera.sees(pixel)) else { return false };
        let [u, v] = pixel.map(|c| c.round().max(0.0) as usize);
        let goes_on = f64::from(self.true_depth.at(u, v)) > place[2] + reach;
        self.frame.depth().at(u, v) > 0.0 && goes_on && range.contains(&place[2])
    }
}

/// The exact pose and size of the thing that a hand carries.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CarriedThing {
    /// Its id among the visible things.
    pub id: usize,
    /// COCO label.
    pub label: &'static str,
    /// Its exact pose. Its own frame has the origin in its middle; at rest x points to the right, y away from
    /// the camera, z up.
    pub world_from_object: Pose,
    /// Full lengths along its axes, metres (a cup's without the handle).
    pub lengths: [f64; 3],
}

/// The change that an event makes to a thing.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SceneChange {
    /// The event.
    pub event: SceneEvent,
    /// The thing's id among the visible things and among the true objects.
    pub id: usize,
    /// COCO label, if it has one.
    pub label: Option<&'static str>,
    /// When the thing begins to move and when it rests again, seconds.
    pub times: [f64; 2],
    /// The box that it fills before the event, in the world; `None` if nothing is there.
    pub before: Option<OrientedBox>,
    /// The box that it fills after the event, to the end; `None` if nothing is there any more.
    pub after: Option<OrientedBox>,
}

/// A labelled thing that stands in different places in two sequences, or in only one of them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlaceChange {
    /// The thing's id among the visible things.
    pub id: usize,
    /// COCO label.
    pub label: &'static str,
    /// The box that it fills in the earlier sequence, in the world; `None` if it is not there.
    pub before: Option<OrientedBox>,
    /// The box that it fills in the later sequence.
    pub after: Option<OrientedBox>,
}

/// A labelled thing and the exact pixels that show it in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct VisibleThing {
    /// Identifies the thing in all frames of a sequence.
    pub id: usize,
    /// COCO label.
    pub label: &'static str,
    /// Whether it is one of the movers.
    pub moves: bool,
    /// Smallest box around the pixels that show it.
    pub bounding_box: BoundingBox,
    /// Number of pixels that show it.
    pub pixels: usize,
}

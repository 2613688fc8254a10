use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, Mask, Pose};
use dymlm_geometry::OrientedBox;

use crate::SceneEvent;

/// One frame of a [`Sequence`](crate::Sequence) and the truth about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SimulatedFrame {
    /// What the camera gives: noisy depth and colour.
    pub frame: Frame,
    /// What the detector gives, best score first.
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
    /// `true` where it meets what does not stand there at the end: a mover, or a thing at rest that an event
    /// takes away later. A finished map is to hold none of it.
    pub transient_mask: Mask,
    /// The things in view that have a label, by ascending id.
    pub visible_things: Vec<VisibleThing>,
    /// The exact place of the thing that a hand carries, if the config asks for one.
    pub carried: Option<CarriedThing>,
    /// Index of the static part that each pixel shows; passing parts and nothing at all lie beyond the static
    /// ones.
    pub(crate) parts: Vec<u16>,
}

/// The thing that a hand carries, exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CarriedThing {
    /// The id that it has among the visible things.
    pub id: usize,
    /// COCO label.
    pub label: &'static str,
    /// Where it is. Its own frame has its origin in the middle; at rest x points to the right, y away from
    /// the camera, z up.
    pub world_from_object: Pose,
    /// Full lengths along its axes, metres (a cup's without the handle).
    pub lengths: [f64; 3],
}

/// What an event does to a thing.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SceneChange {
    /// The event.
    pub event: SceneEvent,
    /// The id that the thing has among the visible things, and among the true objects.
    pub id: usize,
    /// COCO label, if it has one.
    pub label: Option<&'static str>,
    /// When it begins to move and when it rests again, seconds.
    pub times: [f64; 2],
    /// The box in the world that it fills before; none if nothing is there.
    pub before: Option<OrientedBox>,
    /// The box that it fills afterwards, to the end; none if nothing is there any more.
    pub after: Option<OrientedBox>,
}

/// A labelled thing that stands elsewhere in one of two sequences, or in one alone.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlaceChange {
    /// The id that the thing has among the visible things.
    pub id: usize,
    /// COCO label.
    pub label: &'static str,
    /// The box in the world that it fills in the earlier one; none if it is not there.
    pub before: Option<OrientedBox>,
    /// The box that it fills in the later one.
    pub after: Option<OrientedBox>,
}

/// A labelled thing as one frame shows it, exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct VisibleThing {
    /// Tells things of a sequence apart; the same in all its frames.
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

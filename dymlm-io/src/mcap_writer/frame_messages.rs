//! The messages of a frame, except its images.

use dymlm_core::{Detection, PinholeCamera, Pose};

use super::scene_entities::transform;
use crate::ros2::messages::{
    Box2D, CameraInfo, Detection2D, Detection2DArray, Header, Hypothesis, Lens, RegionOfInterest,
    TransformMessage, TransformStamped,
};

/// The `CameraInfo` of a camera without distortion.
pub(super) fn camera_info(header: &Header, camera: &PinholeCamera) -> CameraInfo {
    let (fx, fy, cx, cy) = (camera.fx(), camera.fy(), camera.cx(), camera.cy());
    let lens = Lens {
        height: camera.height() as u32,
        width: camera.width() as u32,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![0.0; 5],
        k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        binning_x: 0,
        binning_y: 0,
        roi: RegionOfInterest { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false },
    };
    CameraInfo { header: header.clone(), lens }
}

/// The transform from the camera to the world.
pub(super) fn camera_transform(header: &Header, world: &str, world_from_camera: &Pose) -> TransformMessage {
    let above = Header { stamp: header.stamp, frame_id: world.to_owned() };
    TransformMessage {
        transforms: vec![TransformStamped {
            header: above,
            child_frame_id: header.frame_id.clone(),
            transform: transform(world_from_camera),
        }],
    }
}

/// Each detection as a box with one hypothesis.
pub(super) fn detection_array(header: &Header, detections: &[Detection]) -> Detection2DArray {
    let found = |detection: &Detection| {
        let bounds = detection.bounding_box();
        let [x_min, y_min, x_max, y_max] = <[f32; 4]>::from(bounds).map(f64::from);
        Detection2D {
            header: header.clone(),
            results: vec![Hypothesis {
                class_id: detection.label().to_owned(),
                score: f64::from(detection.score()),
                pose: transform(&Pose::identity()),
                covariance: ([0.0; 18], [0.0; 18]),
            }],
            bbox: Box2D {
                x: f64::midpoint(x_min, x_max),
                y: f64::midpoint(y_min, y_max),
                theta: 0.0,
                size_x: x_max - x_min,
                size_y: y_max - y_min,
            },
            id: String::new(),
        }
    };
    Detection2DArray { header: header.clone(), detections: detections.iter().map(found).collect() }
}

use dymlm_core::{Frame, Mask};
use dymlm_geometry::OrientedBox;

/// Makes the pixels `false` whose readings lie in a box, given in the camera's frame: a moving body of known
/// pose. A mask of another size than the frame stays as it is. O(pixels of the box's projection).
pub(crate) fn mask_body(frame: &Frame, camera_from_body: &OrientedBox, static_mask: &mut Mask) {
    let camera = frame.camera();
    let (width, height) = (camera.width(), camera.height());
    if (static_mask.width(), static_mask.height()) != (width, height) {
        return;
    }
    let [columns, rows] = projected_bounds(frame, camera_from_body);
    for v in rows.0..rows.1.min(height) {
        for u in columns.0..columns.1.min(width) {
            let reading = frame.depth().at(u, v);
            let is_body = reading > 0.0
                && camera_from_body.contains(camera.back_project([u as f64, v as f64], reading.into()));
            if is_body {
                static_mask.set(u, v, false);
            }
        }
    }
}

/// The first column and row of the box's projection, and one past the last; the whole image when a part of
/// the box lies behind the camera.
fn projected_bounds(frame: &Frame, camera_from_body: &OrientedBox) -> [(usize, usize); 2] {
    let camera = frame.camera();
    let whole = [(0, camera.width()), (0, camera.height())];
    let pixels = camera_from_body.corners().map(|corner| camera.project(corner));
    let along = |axis: usize| {
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for pixel in pixels {
            let c = pixel?[axis];
            (low, high) = (low.min(c), high.max(c));
        }
        // Casts saturate: negative pixels become 0.
        Some((low.floor() as usize, (high.ceil().max(-1.0) + 1.0) as usize))
    };
    match (along(0), along(1)) {
        (Some(columns), Some(rows)) => [columns, rows],
        _ => whole,
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, PinholeCamera, Pose};

    use super::*;

    fn frame() -> Frame {
        let camera = PinholeCamera::new(40, 30, 30.0, 30.0, 19.5, 14.5).unwrap();
        // A thing at 1 m in the middle, a wall at 2 m.
        let near = |i: usize| (15..25).contains(&(i % 40)) && (10..20).contains(&(i / 40));
        let depth = (0..40 * 30).map(|i| if near(i) { 1.0 } else { 2.0 }).collect();
        Frame::new(0.0, camera, DepthImage::new(40, 30, depth).unwrap(), None).unwrap()
    }

    fn body(z: f64) -> OrientedBox {
        let pose = Pose::new([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
        OrientedBox::new(pose, [0.5, 0.5, 0.2]).unwrap()
    }

    #[test]
    fn only_readings_in_the_body_go() {
        let mut mask = Mask::filled(40, 30, true).unwrap();
        mask_body(&frame(), &body(1.05), &mut mask);
        assert_eq!(mask.count(), 40 * 30 - 100);
        assert!(!mask.at(15, 10) && mask.at(14, 10));
    }

    #[test]
    fn bodies_elsewhere_behind_or_about_the_camera_take_nothing_that_is_not_theirs() {
        for z in [1.5, -3.0, 0.0] {
            let mut mask = Mask::filled(40, 30, true).unwrap();
            mask_body(&frame(), &body(z), &mut mask);
            assert_eq!(mask.count(), 40 * 30, "at {z}");
        }
        let mut other = Mask::filled(4, 3, true).unwrap();
        mask_body(&frame(), &body(1.05), &mut other);
        assert_eq!(other.count(), 12);
    }
}

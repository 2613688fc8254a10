use dymlm_core::{BoundingBox, PinholeCamera};

use crate::{Completeness, SideView};

/// Intersection over union of a projected and a detected box. Both are clipped to the image: some detectors
/// report whole things of which the image shows a part. The projection may reach beyond the detection on
/// sides where something else cut the detection off.
pub(crate) fn visible_iou(
    projected: &BoundingBox,
    detected: &BoundingBox,
    completeness: Completeness,
    camera: &PinholeCamera,
) -> f64 {
    let on_image = |own: &BoundingBox| own.clipped(camera.width(), camera.height());
    let Some((projected, detected)) = on_image(projected).zip(on_image(detected)) else { return 0.0 };
    let [left, top, right, bottom] = completeness.sides().map(|side| side != SideView::Whole);
    let forgiven = |is_cut: bool, own: f32, limit: f32| if is_cut { limit } else { own };
    let sides = [
        forgiven(left && projected.x_min() < detected.x_min(), projected.x_min(), detected.x_min()),
        forgiven(top && projected.y_min() < detected.y_min(), projected.y_min(), detected.y_min()),
        forgiven(right && projected.x_max() > detected.x_max(), projected.x_max(), detected.x_max()),
        forgiven(bottom && projected.y_max() > detected.y_max(), projected.y_max(), detected.y_max()),
    ];
    // The projection lies wholly beyond a cut side: nothing is left of it.
    BoundingBox::try_from(sides).map_or(0.0, |visible| visible.iou(&detected))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_side_does_not_count() {
        let camera = PinholeCamera::new(100, 100, 100.0, 100.0, 50.0, 50.0).unwrap();
        let projected = BoundingBox::new(10.0, 10.0, 50.0, 30.0).unwrap();
        let detected = BoundingBox::new(10.0, 10.0, 30.0, 30.0).unwrap();
        let whole = Completeness::default();
        assert_eq!(visible_iou(&projected, &detected, whole, &camera), 0.5);
        let hidden = Completeness { right: SideView::Mover, ..whole };
        assert_eq!(visible_iou(&projected, &detected, hidden, &camera), 1.0);
        // A projection that ends too early still counts.
        assert_eq!(visible_iou(&detected, &projected, hidden, &camera), 0.5);
        let beyond = BoundingBox::new(60.0, 10.0, 80.0, 30.0).unwrap();
        assert_eq!(visible_iou(&beyond, &detected, hidden, &camera), 0.0);
    }

    #[test]
    fn the_image_cuts_the_projection_too() {
        let camera = PinholeCamera::new(100, 100, 100.0, 100.0, 50.0, 50.0).unwrap();
        let projected = BoundingBox::new(-50.0, 0.0, 50.0, 10.0).unwrap();
        let detected = BoundingBox::new(0.0, 0.0, 50.0, 10.0).unwrap();
        assert_eq!(visible_iou(&projected, &detected, Completeness::default(), &camera), 1.0);
        // An amodal detector's box is cut as well.
        assert_eq!(visible_iou(&projected, &projected, Completeness::default(), &camera), 1.0);
    }
}

use dymlm::core::{ColorImage, Detection, Rgb};
use dymlm::files::id_color;
use dymlm_examples::Picture;

/// Width of the lines of boxes, pixels.
const THICKNESS: i64 = 2;
/// Beyond all images, pixels.
const FAR: f32 = 1e9;

/// An image with the boxes of its detections; each label has a colour of its own, darker for weak detections.
pub fn draw_boxes(image: &ColorImage, found: &[Detection]) -> Picture {
    let (width, height) = (image.width(), image.height());
    let mut picture = Picture { name: "detections.png", width, height, pixels: image.data().to_vec() };
    // The highest scores are drawn last, over the others.
    for detection in found.iter().rev() {
        let color =
            label_color(detection.label()).map(|value| (f32::from(value) * brightness(detection)) as u8);
        draw_box(&mut picture, detection, color);
    }
    picture
}

/// Brightness of a box: half for a score of 0, full for 1.
fn brightness(detection: &Detection) -> f32 {
    f32::midpoint(1.0, detection.score())
}

fn draw_box(picture: &mut Picture, detection: &Detection, color: Rgb) {
    let [left, upper, right, lower] =
        <[f32; 4]>::from(detection.bounding_box()).map(|side| side.clamp(-FAR, FAR).round() as i64);
    for v in upper.max(0)..lower.min(picture.height as i64) {
        for u in left.max(0)..right.min(picture.width as i64) {
            let from_border = [u - left, right - 1 - u, v - upper, lower - 1 - v].into_iter().min();
            if from_border.is_some_and(|distance| distance < THICKNESS) {
                picture.set(u, v, color);
            }
        }
    }
}

/// The colour of a label, the same in every picture: a bright colour from its letters (FNV-1a).
fn label_color(label: &str) -> Rgb {
    let hash = label.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    id_color(hash & 0xffff)
}

#[cfg(test)]
mod tests {
    use dymlm::core::BoundingBox;

    use super::*;

    #[test]
    fn sides_are_drawn_and_nothing_else() {
        let image = ColorImage::new(20, 16, vec![[7; 3]; 320]).unwrap();
        let cup = Detection::new("cup", 1.0, BoundingBox::new(4.0, 3.0, 30.0, 13.0).unwrap()).unwrap();
        let picture = draw_boxes(&image, &[cup]);
        let drawn = |u: usize, v: usize| picture.pixels[v * 20 + u] != [7; 3];
        assert!(drawn(4, 3) && drawn(5, 4) && drawn(19, 12) && drawn(4, 12));
        assert!(!drawn(3, 3) && !drawn(6, 5) && !drawn(19, 10) && !drawn(4, 13));
        // Two rows above and below, two columns at the left; the right side is outside the image.
        assert_eq!(picture.pixels.iter().filter(|&&pixel| pixel != [7; 3]).count(), 4 * 16 + 2 * 6);
        let all =
            Detection::new("cup", 1.0, BoundingBox::new(f32::MIN, f32::MIN, f32::MAX, f32::MAX).unwrap());
        assert_eq!(draw_boxes(&image, &[all.unwrap()]).pixels, image.data());
    }

    #[test]
    fn labels_have_colors_of_their_own() {
        assert_ne!(label_color("cup"), label_color("bowl"));
        assert_eq!(label_color("cup"), label_color("cup"));
    }
}

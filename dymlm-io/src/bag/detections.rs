use dymlm_core::{BoundingBox, Detection};

use crate::ros2::messages::{Detection2D, Detection2DArray, decode};

/// The detections of a message: each box gets its hypothesis of the highest score; boxes without any are left
/// out.
pub(super) fn detections_of(message: &[u8], class_names: &[String]) -> Result<Vec<Detection>, String> {
    let array: Detection2DArray = decode(message)?;
    array.detections.iter().filter_map(|found| detection_of(found, class_names).transpose()).collect()
}

fn detection_of(found: &Detection2D, class_names: &[String]) -> Result<Option<Detection>, String> {
    let best = found.results.iter().reduce(|best, next| if next.score > best.score { next } else { best });
    let Some(best) = best else { return Ok(None) };
    let named = if class_names.is_empty() { None } else { best.class_id.parse::<usize>().ok() };
    let label = match named {
        None => best.class_id.as_str(),
        Some(class) => {
            class_names.get(class).ok_or_else(|| format!("class {class} of {} names", class_names.len()))?
        }
    };
    // A rotated box is replaced by the upright box around it.
    let (sin, cos) = found.bbox.theta.sin_cos();
    let (half_x, half_y) = (0.5 * found.bbox.size_x, 0.5 * found.bbox.size_y);
    let [wide, high] = [half_x * cos.abs() + half_y * sin.abs(), half_x * sin.abs() + half_y * cos.abs()];
    let (x, y) = (found.bbox.x, found.bbox.y);
    BoundingBox::new((x - wide) as f32, (y - high) as f32, (x + wide) as f32, (y + high) as f32)
        .and_then(|bounds| Detection::new(label, best.score as f32, bounds))
        .map(Some)
        .map_err(|error| error.to_string())
}

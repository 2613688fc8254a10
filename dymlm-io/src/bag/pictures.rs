use std::path::Path;

use dymlm_core::{PinholeCamera, Rgb};

use super::catalogue::ImageTopic;
use crate::Error;
use crate::image_file::{decode_color_picture, decode_depth_png};
use crate::ros2::messages::{CompressedImage, Image, decode};

/// Millimetres in a metre: 16-bit depth is in millimetres.
const MILLIMETRES: f64 = 1000.0;

pub(super) fn is_depth(topic: &str, images: &ImageTopic) -> bool {
    let format = images.encoding.as_str();
    if images.is_compressed {
        return format.contains("compressedDepth") || (format.starts_with("16UC1") && format.contains("png"));
    }
    // Infrared images may be `mono16`, too: only the topic's name tells them from depth.
    matches!(format, "16UC1" | "32FC1") || (format == "mono16" && topic.contains("depth"))
}

pub(super) fn is_color(images: &ImageTopic) -> bool {
    let format = images.encoding.as_str();
    if images.is_compressed {
        return ["jpeg", "jpg", "png"].iter().any(|kind| format.contains(kind))
            && !format.contains("compressedDepth")
            && !format.starts_with("16UC1");
    }
    pixel_layout(format).is_some()
}

/// The encodings of colours that are read, for messages.
pub(super) const COLOR_ENCODINGS: &str = "rgb8, bgr8, rgba8, bgra8, mono8, 8UC3 and 8UC4";

/// Bytes of a pixel in an encoding of colours, and whether blue comes first. Images of `cv::Mat`, which
/// `cv_bridge` passes on as 8UC3 and 8UC4, have blue first.
fn pixel_layout(encoding: &str) -> Option<(usize, bool)> {
    match encoding {
        "rgb8" => Some((3, false)),
        "bgr8" | "8UC3" => Some((3, true)),
        "rgba8" => Some((4, false)),
        "bgra8" | "8UC4" => Some((4, true)),
        "mono8" => Some((1, false)),
        _ => None,
    }
}

/// Decodes a depth image, metres, into `depth`. `path` is for errors.
pub(super) fn depth_of(
    message: &[u8],
    is_compressed: bool,
    camera: &PinholeCamera,
    path: &Path,
    samples: &mut Vec<u8>,
    mut depth: Vec<f32>,
) -> Result<Vec<f32>, Error> {
    let malformed = |reason: String| Error::malformed(path, reason);
    if is_compressed {
        let image: CompressedImage<'_> = decode(message).map_err(malformed)?;
        return compressed_depth(&image, camera, path, samples, depth);
    }
    let image: Image<'_> = decode(message).map_err(malformed)?;
    check_size(&image, camera, path)?;
    depth.clear();
    let big = image.is_bigendian != 0;
    match image.encoding.as_str() {
        "16UC1" | "mono16" => {
            let metres = (1.0 / MILLIMETRES) as f32;
            let value = |sample: &[u8; 2]| {
                if big { u16::from_be_bytes(*sample) } else { u16::from_le_bytes(*sample) }
            };
            for row in rows(&image, 2).map_err(malformed)? {
                depth.extend(row.as_chunks().0.iter().map(|sample| f32::from(value(sample)) * metres));
            }
        }
        "32FC1" => {
            let value = |sample: &[u8; 4]| {
                if big { f32::from_be_bytes(*sample) } else { f32::from_le_bytes(*sample) }
            };
            for row in rows(&image, 4).map_err(malformed)? {
                depth.extend(row.as_chunks().0.iter().map(value));
            }
        }
        other => return Err(malformed(format!("depth of encoding {other:?}; 16UC1 and 32FC1 are read"))),
    }
    Ok(depth)
}

/// Decodes a PNG of millimetres, or the format of `compressed_depth_image_transport`: 12 bytes of parameters,
/// then a PNG of millimetres or of inverse depth.
fn compressed_depth(
    image: &CompressedImage<'_>,
    camera: &PinholeCamera,
    path: &Path,
    samples: &mut Vec<u8>,
    depth: Vec<f32>,
) -> Result<Vec<f32>, Error> {
    let format = image.format.as_str();
    if !format.contains("compressedDepth") {
        return Ok(decode_depth_png(path, image.data, MILLIMETRES, Some(camera), samples, depth)?.2);
    }
    if format.contains("rvl") {
        return Err(Error::malformed(path, "compressedDepth by RVL; PNG is read"));
    }
    let Some((&[_, _, _, _, a0, a1, a2, a3, b0, b1, b2, b3], png)) = image.data.split_first_chunk::<12>()
    else {
        return Err(Error::malformed(path, "compressedDepth of less than 12 bytes"));
    };
    if !format.starts_with("32FC1") {
        return Ok(decode_depth_png(path, png, MILLIMETRES, Some(camera), samples, depth)?.2);
    }
    let (a, b) = (f32::from_le_bytes([a0, a1, a2, a3]), f32::from_le_bytes([b0, b1, b2, b3]));
    let mut depth = decode_depth_png(path, png, 1.0, Some(camera), samples, depth)?.2;
    for value in &mut depth {
        *value = if *value == 0.0 { 0.0 } else { a / (*value - b) };
    }
    Ok(depth)
}

/// Decodes a colour image into `colors`. `path` is for errors.
pub(super) fn color_of(
    message: &[u8],
    is_compressed: bool,
    camera: &PinholeCamera,
    path: &Path,
    mut colors: Vec<Rgb>,
) -> Result<Vec<Rgb>, Error> {
    let malformed = |reason: String| Error::malformed(path, reason);
    if is_compressed {
        let image: CompressedImage<'_> = decode(message).map_err(malformed)?;
        return Ok(decode_color_picture(path, image.data, Some(camera), colors)?.2);
    }
    let image: Image<'_> = decode(message).map_err(malformed)?;
    check_size(&image, camera, path)?;
    colors.clear();
    let encoding = image.encoding.as_str();
    let (bytes, is_bgr) = pixel_layout(encoding)
        .ok_or_else(|| malformed(format!("colours of encoding {encoding:?}; {COLOR_ENCODINGS} are read")))?;
    for row in rows(&image, bytes).map_err(malformed)? {
        colors.extend(row.chunks_exact(bytes).filter_map(|pixel| match *pixel {
            [grey] => Some([grey; 3]),
            [b, g, r, ..] if is_bgr => Some([r, g, b]),
            [r, g, b, ..] => Some([r, g, b]),
            _ => None,
        }));
    }
    Ok(colors)
}

fn check_size(image: &Image<'_>, camera: &PinholeCamera, path: &Path) -> Result<(), Error> {
    let (actual_width, actual_height) = (image.width as usize, image.height as usize);
    let (width, height) = (camera.width(), camera.height());
    if (actual_width, actual_height) == (width, height) {
        return Ok(());
    }
    Err(Error::ImageSize { path: path.to_path_buf(), width, height, actual_width, actual_height })
}

/// The rows of an image, without the padding at their ends.
fn rows<'a>(image: &Image<'a>, bytes: usize) -> Result<impl Iterator<Item = &'a [u8]>, String> {
    let (step, length) = (image.step as usize, image.width as usize * bytes);
    let height = image.height as usize;
    let needed = step.checked_mul(height.saturating_sub(1)).and_then(|above| above.checked_add(length));
    if step < length || step == 0 || needed.is_none_or(|needed| image.data.len() < needed) {
        return Err(format!(
            "{} bytes in rows of {step} for {}x{height} pixels of {bytes} bytes",
            image.data.len(),
            image.width
        ));
    }
    Ok(image.data.chunks(step).take(height).filter_map(move |row| row.get(..length)))
}

use std::io::Cursor;

use dymlm_core::{ColorImage, DepthImage};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageResult};

use super::{ColorEncoding, DepthEncoding};

/// Place of the parameters of inverse depth in `compressed_depth_image_transport`; millimetres need none.
const NO_PARAMETERS: [u8; 12] = [0; 12];

/// The format string and the encoded file of a colour image; `None` when colour is not written.
pub(super) fn color_picture(
    color: &ColorImage,
    encoding: ColorEncoding,
    quality: u8,
) -> ImageResult<Option<(&'static str, Vec<u8>)>> {
    let (width, height) = (color.width() as u32, color.height() as u32);
    let (samples, mut file) = (color.data().as_flattened(), Vec::new());
    let format = match encoding {
        ColorEncoding::None => return Ok(None),
        ColorEncoding::Jpeg => {
            let encoder = JpegEncoder::new_with_quality(&mut file, quality);
            encoder.write_image(samples, width, height, ExtendedColorType::Rgb8)?;
            "rgb8; jpeg compressed bgr8"
        }
        ColorEncoding::Png => {
            fast_png(&mut file).write_image(samples, width, height, ExtendedColorType::Rgb8)?;
            "rgb8; png compressed bgr8"
        }
    };
    Ok(Some((format, file)))
}

/// An encoded depth image: raw samples, or a compressed file.
pub(super) enum DepthPicture {
    Raw { encoding: &'static str, step: u32, data: Vec<u8> },
    Packed { format: &'static str, data: Vec<u8> },
}

/// The encoded depth image; `None` when depth is not written.
pub(super) fn depth_picture(
    depth: &DepthImage,
    encoding: DepthEncoding,
) -> ImageResult<Option<DepthPicture>> {
    let width = depth.width() as u32;
    Ok(Some(match encoding {
        DepthEncoding::None => return Ok(None),
        DepthEncoding::Millimetres => DepthPicture::Raw {
            encoding: "16UC1",
            step: 2 * width,
            data: depth.data().iter().flat_map(|&metres| millimetres(metres).to_le_bytes()).collect(),
        },
        DepthEncoding::Exact => DepthPicture::Raw {
            encoding: "32FC1",
            step: 4 * width,
            data: depth.data().iter().flat_map(|metres| metres.to_le_bytes()).collect(),
        },
        DepthEncoding::MillimetresPng => {
            let mut file = Cursor::new(NO_PARAMETERS.to_vec());
            file.set_position(NO_PARAMETERS.len() as u64);
            // The encoder takes samples in the machine's byte order.
            let samples: Vec<u8> =
                depth.data().iter().flat_map(|&metres| millimetres(metres).to_ne_bytes()).collect();
            let height = depth.height() as u32;
            fast_png(&mut file).write_image(&samples, width, height, ExtendedColorType::L16)?;
            DepthPicture::Packed { format: "16UC1; compressedDepth png", data: file.into_inner() }
        }
    }))
}

/// Whole millimetres; 0, no reading, for depths that do not fit into 16 bits.
fn millimetres(metres: f32) -> u16 {
    let value = (f64::from(metres) * 1000.0).round();
    if value <= f64::from(u16::MAX) { value as u16 } else { 0 }
}

/// A fast PNG encoder: the smallest PNGs take longer to make than the time between two frames.
fn fast_png<W: std::io::Write>(out: W) -> PngEncoder<W> {
    PngEncoder::new_with_quality(out, CompressionType::Fast, FilterType::Adaptive)
}

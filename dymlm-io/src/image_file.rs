//! Colour images and depth images as files.

use std::fs;
use std::io::{Cursor, Read};
use std::path::Path;

use dymlm_core::{ColorImage, DepthImage, PinholeCamera, Rgb};
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::{PngDecoder, PngEncoder};
use image::{ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageResult, Limits};

use crate::{Error, write_atomically};

/// Largest number of pixels of an image that is read without a known camera: 8192 x 4096, more than depth
/// cameras have. A PNG of some hundred bytes can declare a thousand times as many pixels, which would be
/// decoded into gigabytes.
pub const MAX_IMAGE_PIXELS: usize = 1 << 25;

/// Most bytes of a PNG's metadata; colour profiles have some megabytes at most. A chunk of 1 MB can hold one
/// that would be inflated into a gigabyte before the picture's size is known.
const MAX_METADATA_BYTES: u64 = 1 << 23;

/// Buffers for reading and decoding files, reused from one image to the next.
#[derive(Debug, Clone, Default)]
pub(crate) struct DecodeBuffers {
    file: Vec<u8>,
    pub(crate) samples: Vec<u8>,
}

/// Reads a 16-bit greyscale PNG as depth in metres: value / `depth_scale`; 0 = no reading.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] when the file is not a complete PNG, has another pixel format than
/// 16-bit greyscale or more than [`MAX_IMAGE_PIXELS`], or `depth_scale` is not finite and positive.
pub fn read_depth_png(path: impl AsRef<Path>, depth_scale: f64) -> Result<DepthImage, Error> {
    let path = path.as_ref();
    let (width, height, depth) =
        decode_depth(path, depth_scale, None, &mut DecodeBuffers::default(), Vec::new())?;
    DepthImage::new(width, height, depth).map_err(|error| Error::malformed(path, error.to_string()))
}

/// Reads a colour image, JPEG or PNG. Grey images become grey colours, and an alpha channel is dropped.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] when the file is not a complete JPEG or PNG, or has more than
/// [`MAX_IMAGE_PIXELS`].
pub fn read_color_image(path: impl AsRef<Path>) -> Result<ColorImage, Error> {
    let path = path.as_ref();
    let (width, height, colors) = decode_color(path, None, &mut DecodeBuffers::default(), Vec::new())?;
    ColorImage::new(width, height, colors).map_err(|error| Error::malformed(path, error.to_string()))
}

/// Writes a picture of `width` x `height` colours, row by row from the top left, as PNG, atomically.
///
/// # Errors
///
/// [`Error::BufferLength`] when `colors` is not `width * height` long, or a side is zero; else as
/// [`write_atomically`].
pub fn write_png(path: impl AsRef<Path>, width: usize, height: usize, colors: &[Rgb]) -> Result<(), Error> {
    encode_png(path.as_ref(), width, height, colors.len(), colors.as_flattened(), ExtendedColorType::Rgb8)
}

/// Writes depth as 16-bit greyscale PNG, atomically: value = depth * `depth_scale`, rounded; 5000 for TUM
/// PNGs (up to 13.1 m), 1000 for millimetres (up to 65.5 m). Depth too large for 16 bits is written as 0, no
/// reading.
///
/// # Errors
///
/// [`Error::Malformed`] when `depth_scale` is not finite and positive; else as [`write_atomically`].
pub fn write_depth_png(path: impl AsRef<Path>, depth: &DepthImage, depth_scale: f64) -> Result<(), Error> {
    let path = path.as_ref();
    check_depth_scale(path, depth_scale)?;
    let stored = |metres: f32| {
        let value = (f64::from(metres) * depth_scale).round();
        if value <= f64::from(u16::MAX) { value as u16 } else { 0 }
    };
    // The encoder takes samples in the machine's byte order.
    let samples: Vec<u8> = depth.data().iter().flat_map(|&metres| stored(metres).to_ne_bytes()).collect();
    let (width, height) = (depth.width(), depth.height());
    encode_png(path, width, height, depth.data().len(), &samples, ExtendedColorType::L16)
}

/// Decodes a depth image into `depth`, which is emptied first and keeps its capacity. Returns width, height
/// and the buffer. An image of another size than the camera is refused before its pixels are decoded.
pub(crate) fn decode_depth(
    path: &Path,
    depth_scale: f64,
    camera: Option<&PinholeCamera>,
    buffers: &mut DecodeBuffers,
    depth: Vec<f32>,
) -> Result<(usize, usize, Vec<f32>), Error> {
    read_file(path, &mut buffers.file)?;
    decode_depth_png(path, &buffers.file, depth_scale, camera, &mut buffers.samples, depth)
}

/// As [`decode_depth`], of a PNG in memory; `path` is for errors.
pub(crate) fn decode_depth_png(
    path: &Path,
    png: &[u8],
    depth_scale: f64,
    camera: Option<&PinholeCamera>,
    samples: &mut Vec<u8>,
    mut depth: Vec<f32>,
) -> Result<(usize, usize, Vec<f32>), Error> {
    check_depth_scale(path, depth_scale)?;
    let decoder = png_decoder(path, png, camera)?;
    let (width, height) = checked_size(path, &decoder, camera)?;
    if decoder.original_color_type() != ExtendedColorType::L16 {
        let reason = format!(
            "a depth image of {:?} pixels instead of 16-bit greyscale",
            decoder.original_color_type()
        );
        return Err(Error::malformed(path, reason));
    }
    samples.resize(2 * width * height, 0);
    decoder.read_image(samples).map_err(undecodable(path))?;
    let metres = (1.0 / depth_scale) as f32;
    depth.clear();
    depth.extend(samples.as_chunks().0.iter().map(|&sample| f32::from(u16::from_ne_bytes(sample)) * metres));
    Ok((width, height, depth))
}

/// Decodes a colour image into `colors`, which keeps its capacity. Returns width, height and the buffer.
pub(crate) fn decode_color(
    path: &Path,
    camera: Option<&PinholeCamera>,
    buffers: &mut DecodeBuffers,
    colors: Vec<Rgb>,
) -> Result<(usize, usize, Vec<Rgb>), Error> {
    read_file(path, &mut buffers.file)?;
    decode_color_picture(path, &buffers.file, camera, colors)
}

/// As [`decode_color`], of a picture in memory; `path` is for errors.
pub(crate) fn decode_color_picture(
    path: &Path,
    picture: &[u8],
    camera: Option<&PinholeCamera>,
    colors: Vec<Rgb>,
) -> Result<(usize, usize, Vec<Rgb>), Error> {
    if picture.starts_with(b"\xff\xd8") {
        // The decoder silently fills the missing part of a truncated picture with grey.
        if !has_jpeg_end(picture) {
            return Err(Error::malformed(path, "the JPEG is truncated: it has no end marker"));
        }
        let decoder = JpegDecoder::new(Cursor::new(picture)).map_err(undecodable(path))?;
        decode_rgb(path, decoder, camera, colors)
    } else {
        decode_rgb(path, png_decoder(path, picture, camera)?, camera, colors)
    }
}

/// A decoder that takes little memory beside that of the picture, which is refused by its size if need be
/// before it is decoded.
fn png_decoder<'a>(
    path: &Path,
    png: &'a [u8],
    camera: Option<&PinholeCamera>,
) -> Result<PngDecoder<Cursor<&'a [u8]>>, Error> {
    // The width is where every PNG has it. A larger one than will be allowed counts as the largest.
    let claimed = png.get(16..20).and_then(|width| width.try_into().ok()).map_or(0, u32::from_be_bytes);
    let widest = camera.map_or(MAX_IMAGE_PIXELS, PinholeCamera::width).min(claimed as usize);
    let mut limits = Limits::no_limits();
    // The decoder keeps a row of at most 8 bytes a pixel.
    limits.max_alloc = Some(MAX_METADATA_BYTES + 8 * widest as u64);
    PngDecoder::with_limits(Cursor::new(png), limits).map_err(undecodable(path))
}

fn decode_rgb(
    path: &Path,
    decoder: impl ImageDecoder,
    camera: Option<&PinholeCamera>,
    mut colors: Vec<Rgb>,
) -> Result<(usize, usize, Vec<Rgb>), Error> {
    let (width, height) = checked_size(path, &decoder, camera)?;
    if decoder.color_type() == ColorType::Rgb8 {
        colors.resize(width * height, [0; 3]);
        decoder.read_image(colors.as_flattened_mut()).map_err(undecodable(path))?;
    } else {
        let picture = DynamicImage::from_decoder(decoder).map_err(undecodable(path))?.into_rgb8();
        colors.clear();
        colors.extend_from_slice(picture.as_raw().as_chunks().0);
    }
    Ok((width, height, colors))
}

fn read_file(path: &Path, buffer: &mut Vec<u8>) -> Result<(), Error> {
    buffer.clear();
    let mut file = fs::File::open(path).map_err(Error::io(path))?;
    file.read_to_end(buffer).map_err(Error::io(path))?;
    Ok(())
}

/// The size of a picture; an error when it is not the camera's or, without a camera, above the limit.
fn checked_size(
    path: &Path,
    decoder: &impl ImageDecoder,
    camera: Option<&PinholeCamera>,
) -> Result<(usize, usize), Error> {
    let (actual_width, actual_height) = decoder.dimensions();
    let (actual_width, actual_height) = (actual_width as usize, actual_height as usize);
    if let Some(camera) = camera {
        let (width, height) = (camera.width(), camera.height());
        if (width, height) != (actual_width, actual_height) {
            let path = path.to_path_buf();
            return Err(Error::ImageSize { path, width, height, actual_width, actual_height });
        }
        return Ok((width, height));
    }
    check_pixels(actual_width, actual_height).map_err(|reason| Error::malformed(path, reason))?;
    Ok((actual_width, actual_height))
}

/// Refuses cameras of images that would be refused, before tables of their size are made.
pub(crate) fn check_size_of(camera: &PinholeCamera) -> Result<(), String> {
    check_pixels(camera.width(), camera.height())
}

fn check_pixels(width: usize, height: usize) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(pixels) if pixels <= MAX_IMAGE_PIXELS => Ok(()),
        _ => Err(format!("an image of {width}x{height} pixels is larger than {MAX_IMAGE_PIXELS} pixels")),
    }
}

fn check_depth_scale(path: &Path, depth_scale: f64) -> Result<(), Error> {
    if depth_scale.is_finite() && depth_scale > 0.0 {
        Ok(())
    } else {
        Err(Error::malformed(path, dymlm_core::Error::DepthScale(depth_scale).to_string()))
    }
}

fn undecodable(path: &Path) -> impl FnOnce(image::ImageError) -> Error {
    move |error| Error::malformed(path, error.to_string())
}

/// Whether a JPEG has its end marker. Segments before the image data (one may hold a thumbnail) are skipped
/// by their lengths. In the image data a byte 0xff is always followed by 0 unless it begins a marker.
fn has_jpeg_end(file: &[u8]) -> bool {
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = file.get(at..at + 4) {
        match marker {
            // A fill byte.
            0xff => at += 1,
            0xda => return file[at..].windows(2).any(|pair| pair == b"\xff\xd9"),
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
    false
}

fn encode_png(
    path: &Path,
    width: usize,
    height: usize,
    pixels: usize,
    samples: &[u8],
    format: ExtendedColorType,
) -> Result<(), Error> {
    let size = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    match size {
        Some((columns, rows)) if pixels > 0 && width.checked_mul(height) == Some(pixels) => {
            write_atomically(path, |out| -> ImageResult<()> {
                PngEncoder::new(out).write_image(samples, columns, rows, format)
            })
        }
        _ => Err(Error::BufferLength { path: path.to_path_buf(), width, height, actual: pixels }),
    }
}

use std::collections::BTreeMap;
use std::fs;

use dymlm_core::{BoundingBox, ColorImage};
use dymlm_tracking::{FlowConfig, FlowPoint, GrayImage, ImagePyramid, KcfConfig, KcfTracker, OpticalFlow};

use crate::Failure;
use crate::request::Request;
use crate::timing::{Timing, timed};

/// Images of 640x480 by path; each file is read once.
#[derive(Default)]
pub(crate) struct Sequences {
    color: BTreeMap<String, Vec<ColorImage>>,
    gray: BTreeMap<String, Vec<GrayImage>>,
}

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

impl Sequences {
    /// The images of a file with 3 bytes per pixel.
    fn color(&mut self, path: &str) -> Result<&[ColorImage], Failure> {
        images(&mut self.color, path, 3, |image| {
            Ok(ColorImage::new(WIDTH, HEIGHT, image.as_chunks().0.to_vec())?)
        })
    }

    /// The images of a file with a byte per pixel.
    fn gray(&mut self, path: &str) -> Result<&[GrayImage], Failure> {
        images(&mut self.gray, path, 1, |image| {
            let values = image.iter().map(|&byte| f32::from(byte) / 255.0).collect();
            Ok(GrayImage::new(WIDTH, HEIGHT, values)?)
        })
    }
}

/// The images of a file, from those read before or from the file.
fn images<'a, T>(
    known: &'a mut BTreeMap<String, Vec<T>>,
    path: &str,
    bytes_a_pixel: usize,
    image_of: impl FnMut(&[u8]) -> Result<T, Failure>,
) -> Result<&'a [T], Failure> {
    if !known.contains_key(path) {
        let bytes = fs::read(path).map_err(|error| format!("{path}: {error}"))?;
        let images = bytes.chunks_exact(WIDTH * HEIGHT * bytes_a_pixel).map(image_of);
        known.insert(path.to_owned(), images.collect::<Result<_, Failure>>()?);
    }
    Ok(known.get(path).map_or(&[], Vec::as_slice))
}

fn rows<const N: usize>(path: &str) -> Result<Vec<[f32; N]>, Failure> {
    let bytes = fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    Ok(numbers.as_chunks().0.to_vec())
}

/// `kcf images= targets=`: tracks each target from its first box; the targets' file has one box per row. The
/// clock includes the conversion to grey, as `OpenCV`'s tracker takes colour images and converts them.
pub(crate) fn kcf(request: &Request, sequences: &mut Sequences) -> Result<Timing, Failure> {
    let targets: Vec<[f32; 6]> = rows(request.text("targets")?)?;
    let images = sequences.color(request.text("images")?)?;
    let (boxes, timing) = timed(|| follow_boxes(images, &targets));
    if let Some(path) = request.result() {
        let boxes: Vec<u8> =
            boxes?.iter().flat_map(|&b| <[f32; 4]>::from(b)).flat_map(f32::to_le_bytes).collect();
        fs::write(path, boxes)?;
    }
    Ok(timing)
}

fn follow_boxes(images: &[ColorImage], targets: &[[f32; 6]]) -> Result<Vec<BoundingBox>, Failure> {
    let config = KcfConfig::default();
    let mut boxes = Vec::with_capacity(targets.len());
    let mut tracker: Option<(f32, KcfTracker)> = None;
    let mut gray = GrayImage::empty();
    for &[track, frame, x_min, y_min, x_max, y_max] in targets {
        gray.assign_color(images.get(frame as usize).ok_or("a target beyond the last image")?);
        match &mut tracker {
            Some((id, tracker)) if *id == track => boxes.push(tracker.update(&gray).bounding_box),
            _ => {
                let first = BoundingBox::new(x_min, y_min, x_max, y_max)?;
                tracker = Some((track, KcfTracker::new(&gray, first, &config)?));
                boxes.push(first);
            }
        }
    }
    Ok(boxes)
}

/// `optical_flow images= points=`: tracks 200 points in each pair of grey images; a row of the points' file
/// has 4 f32, of which the first two are x and y of the start.
pub(crate) fn optical_flow(request: &Request, sequences: &mut Sequences) -> Result<Timing, Failure> {
    const POINTS: usize = 200;
    let points: Vec<[f32; 4]> = rows(request.text("points")?)?;
    let starts: Vec<[f32; 2]> = points.iter().map(|&[x, y, ..]| [x, y]).collect();
    let images = sequences.gray(request.text("images")?)?;
    let mut config = FlowConfig::default();
    // As in OpenCV's function, points are not tracked back.
    config.max_forward_backward = None;
    let mut flow = OpticalFlow::new(&config)?;
    let [mut from, mut to] = [ImagePyramid::empty(config.halvings), ImagePyramid::empty(config.halvings)];
    let mut found: Vec<Vec<FlowPoint>> = vec![Vec::with_capacity(POINTS); images.len() / 2];
    let ((), timing) = timed(|| {
        for ((pair, starts), found) in images.chunks_exact(2).zip(starts.chunks_exact(POINTS)).zip(&mut found)
        {
            from.build(&pair[0]);
            to.build(&pair[1]);
            flow.track_into(&from, &to, starts, starts, found);
        }
    });
    if let Some(path) = request.result() {
        let ends: Vec<u8> =
            found.iter().flatten().flat_map(|found| found.point).flat_map(f32::to_le_bytes).collect();
        fs::write(path, ends)?;
    }
    Ok(timing)
}

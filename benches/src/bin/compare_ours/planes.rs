use std::collections::BTreeMap;

use dymlm_core::{DepthImage, PinholeCamera};
use dymlm_planes::{PlaneConfig, PlaneDetector, PlaneExtractor};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// Depth images as our types, by path, and the engines, which keep their buffers.
#[derive(Default)]
pub(crate) struct Planes {
    images: BTreeMap<String, Images>,
    min_support: usize,
    detector: Option<PlaneDetector>,
    extractor: Option<PlaneExtractor>,
}

struct Images {
    camera: PinholeCamera,
    depths: Vec<DepthImage>,
}

/// A plane found, as its row of the result file.
type Row = [f64; 9];

/// `planes input= min_support= steps=all|extraction`: the planes of each depth image. All steps are extraction, robust
/// refinement with covariance and edge points, and the filter.
pub(crate) fn run(request: &Request, inputs: &mut Inputs, kept: &mut Planes) -> Result<Timing, Failure> {
    let path = request.text("input")?;
    if !kept.images.contains_key(path) {
        kept.images.insert(path.to_owned(), read(inputs.floats(path)?)?);
    }
    let images = kept.images.get(path).ok_or("no images")?;
    let mut config = PlaneConfig::default();
    config.extraction.min_support = request.number("min_support")?;
    if kept.min_support != config.extraction.min_support {
        kept.min_support = config.extraction.min_support;
        (kept.detector, kept.extractor) = (None, None);
    }

    let mut rows: Vec<Row> = Vec::new();
    let (worked, timing) = match request.text("steps")? {
        "all" => {
            let detector = kept_or_new(&mut kept.detector, || PlaneDetector::new(&config))?;
            timed(|| detect(detector, images, &mut rows))
        }
        "extraction" => {
            let extractor =
                kept_or_new(&mut kept.extractor, || PlaneExtractor::new(config.extraction.clone()))?;
            timed(|| extract(extractor, images, &mut rows))
        }
        other => return Err(format!("steps={other} is neither all nor extraction").into()),
    };
    worked?;
    if let Some(path) = request.result() {
        write_numbers(path, rows.as_flattened())?;
    }
    Ok(timing)
}

fn detect(detector: &mut PlaneDetector, images: &Images, rows: &mut Vec<Row>) -> Result<(), Failure> {
    for (index, depth) in images.depths.iter().enumerate() {
        let planes = detector.detect(&images.camera, depth, None, &[])?;
        rows.extend(planes.iter().map(|found| row(index, found.plane, found.centroid, found.support)));
    }
    Ok(())
}

fn extract(extractor: &mut PlaneExtractor, images: &Images, rows: &mut Vec<Row>) -> Result<(), Failure> {
    for (index, depth) in images.depths.iter().enumerate() {
        let segments = extractor.extract(&images.camera, depth, None)?.segments();
        rows.extend(segments.iter().map(|found| row(index, found.plane, found.centroid, found.support)));
    }
    Ok(())
}

fn row(image: usize, plane: dymlm_core::Plane, [cx, cy, cz]: [f64; 3], support: usize) -> Row {
    let [x, y, z] = plane.normal();
    [image as f64, x, y, z, plane.d(), cx, cy, cz, support as f64]
}

fn kept_or_new<T, E>(kept: &mut Option<T>, new: impl FnOnce() -> Result<T, E>) -> Result<&mut T, E> {
    Ok(match kept {
        Some(engine) => engine,
        None => kept.insert(new()?),
    })
}

/// See `harness/files.py`: width and height share the array of f32 as bits.
fn read(numbers: &[f32]) -> Result<Images, Failure> {
    let Some((&[width, height, fx, fy, cx, cy], rest)) = numbers.split_first_chunk() else {
        return Err("depth images without a header".into());
    };
    let (width, height) = (width.to_bits() as usize, height.to_bits() as usize);
    let [fx, fy, cx, cy] = [fx, fy, cx, cy].map(f64::from);
    let camera = PinholeCamera::new(width, height, fx, fy, cx, cy)?;
    let images = rest.chunks_exact(width * height);
    let depths =
        images.map(|image| DepthImage::new(width, height, image.to_vec())).collect::<Result<_, _>>()?;
    Ok(Images { camera, depths })
}

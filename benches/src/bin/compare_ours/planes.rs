use std::collections::BTreeMap;

use dymlm_core::{DepthImage, Frame, PinholeCamera, SensorModel};
use dymlm_planes::{PlaneDetector, PlaneDetectorConfig};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// Depth images converted to our types, by path, and the detector, which keeps its buffers.
#[derive(Default)]
pub(crate) struct Planes {
    images: BTreeMap<String, Vec<Frame>>,
    min_support: usize,
    detector: Option<PlaneDetector>,
}

/// A detected plane, as a row of the result file.
type Row = [f64; 9];

/// `planes input= min_support=`: detects the planes of each depth image, with refinement, covariance, samples
/// of the patch and the filter.
pub(crate) fn run(request: &Request, inputs: &mut Inputs, kept: &mut Planes) -> Result<Timing, Failure> {
    let path = request.text("input")?;
    if !kept.images.contains_key(path) {
        kept.images.insert(path.to_owned(), read(inputs.floats(path)?)?);
    }
    let images = kept.images.get(path).ok_or("no images")?;
    let mut config = PlaneDetectorConfig::default();
    config.min_support = request.number("min_support")?;
    let detector = match kept.detector.take_if(|_| kept.min_support == config.min_support) {
        Some(detector) => detector,
        None => PlaneDetector::new(&config, &SensorModel::kinect())?,
    };
    kept.min_support = config.min_support;
    let detector = kept.detector.insert(detector);

    let mut rows: Vec<Row> = Vec::new();
    let (worked, timing) = timed(|| detect(detector, images, &mut rows));
    worked?;
    if let Some(path) = request.result() {
        write_numbers(path, rows.as_flattened())?;
    }
    Ok(timing)
}

fn detect(detector: &mut PlaneDetector, images: &[Frame], rows: &mut Vec<Row>) -> Result<(), Failure> {
    for (index, frame) in images.iter().enumerate() {
        let planes = detector.detect(frame, None, &[])?;
        rows.extend(planes.iter().map(|found| row(index, found.plane, found.centroid, found.support)));
    }
    Ok(())
}

fn row(image: usize, plane: dymlm_core::Plane, [cx, cy, cz]: [f64; 3], support: usize) -> Row {
    let [x, y, z] = plane.normal();
    [image as f64, x, y, z, plane.d(), cx, cy, cz, support as f64]
}

/// Reads the format of `harness/files.py`: the bits of width and height stand among the f32.
pub(crate) fn read(numbers: &[f32]) -> Result<Vec<Frame>, Failure> {
    let Some((&[width, height, fx, fy, cx, cy], rest)) = numbers.split_first_chunk() else {
        return Err("depth images without a header".into());
    };
    let (width, height) = (width.to_bits() as usize, height.to_bits() as usize);
    let [fx, fy, cx, cy] = [fx, fy, cx, cy].map(f64::from);
    let camera = PinholeCamera::new(width, height, fx, fy, cx, cy)?;
    let frame = |image: &[f32]| {
        let depth = DepthImage::new(width, height, image.to_vec())?;
        Ok(Frame::new(0.0, camera, depth, None)?)
    };
    rest.chunks_exact(width * height).map(frame).collect()
}

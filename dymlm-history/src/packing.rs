use bytes::{Buf, BufMut};
use dymlm_core::{BoundingBox, Detection, Mask, PinholeCamera};
use dymlm_objects::SightedPoint;
use dymlm_planes::DetectedPlane;

use crate::Observation;
use crate::color_code::ReducedColors;
use crate::depth_code::{put_depth, take_depth};
use crate::packing_buffers::PackingBuffers;

/// Most bytes that a pixel unpacks to besides its coded depth and colour (its value in a depth image without
/// repeated values, a bit in three masks and in a detection's mask), and most bytes that everything else
/// unpacks to.
const MOST_BYTES_A_PIXEL: usize = 64;
const MOST_BYTES_BESIDE: usize = 1 << 26;

/// Packs an observation. Its bytes do not depend on what the buffers were used for before.
pub(crate) fn pack(observation: &Observation, buffers: &mut PackingBuffers) -> Vec<u8> {
    let Observation {
        frame,
        colors,
        static_mask,
        mover_mask,
        unproven_mask,
        detections,
        sighted_points,
        planes,
    } = observation;
    let PackingBuffers { plane, beside: out, images, .. } = buffers;
    out.clear();
    images.clear();
    out.put_f64_le(frame.timestamp());
    put_camera(frame.camera(), out);
    put_depth(frame.depth(), plane, out, images);
    out.put_u8(colors.is_some().into());
    if let Some(colors) = colors {
        colors.put(plane, images);
    }
    for mask in [static_mask, mover_mask, unproven_mask] {
        put_mask(mask, out);
    }
    put_count(detections.as_ref().map_or(0, |found| found.len() + 1), out);
    detections.iter().flatten().for_each(|detection| put_detection(detection, out));
    put_count(sighted_points.len(), out);
    for point in sighted_points {
        out.put_u64_le(point.id);
        for c in point.pixel {
            out.put_f32_le(c);
        }
    }
    put_count(planes.len(), out);
    for plane in planes {
        plane.put_bytes(out);
    }
    buffers.deflate();
    sealed(&buffers.deflated, &buffers.images)
}

/// Puts together a checksum, the length of the first part, and both parts.
fn sealed(deflated: &[u8], images: &[u8]) -> Vec<u8> {
    // One more for the kind that follows.
    let mut packed = Vec::with_capacity(9 + deflated.len() + images.len());
    packed.put_u32_le(0);
    put_count(deflated.len(), &mut packed);
    packed.extend_from_slice(deflated);
    packed.extend_from_slice(images);
    let checksum = crc32fast::hash(&packed[4..]);
    packed[..4].copy_from_slice(&checksum.to_le_bytes());
    packed
}

/// Splits the two parts; `None` when a byte has changed.
fn unsealed(mut packed: &[u8]) -> Option<(&[u8], &[u8])> {
    let checksum = packed.try_get_u32_le().ok()?;
    if crc32fast::hash(packed) != checksum {
        return None;
    }
    let length = take_count(&mut packed)?;
    packed.split_at_checked(length)
}

/// Reads the observation that was packed; `None` when it is damaged.
pub(crate) fn unpack(packed: &[u8]) -> Option<Observation> {
    let limit =
        PinholeCamera::MAX_PIXELS.saturating_mul(MOST_BYTES_A_PIXEL).saturating_add(MOST_BYTES_BESIDE);
    let (deflated, mut images) = unsealed(packed)?;
    let bytes = miniz_oxide::inflate::decompress_to_vec_with_limit(deflated, limit).ok()?;
    let (bytes, images) = (&mut bytes.as_slice(), &mut images);
    let timestamp = bytes.try_get_f64_le().ok()?;
    let camera = take_camera(bytes)?;
    let size = [camera.width(), camera.height()];
    let depth = take_depth(bytes, images, size)?;
    let colors = match bytes.try_get_u8().ok()? {
        0 => None,
        _ => Some(ReducedColors::take(images, size)?),
    };
    let mut observation = Observation::of_images(timestamp, camera, depth, colors).ok()?;
    observation.static_mask = take_mask(bytes, size)?;
    observation.mover_mask = take_mask(bytes, size)?;
    observation.unproven_mask = take_mask(bytes, size)?;
    observation.detections = match take_count(bytes)? {
        0 => None,
        count => Some((1..count).map(|_| take_detection(bytes, size)).collect::<Option<_>>()?),
    };
    observation.sighted_points = (0..take_count(bytes)?).map(|_| take_point(bytes)).collect::<Option<_>>()?;
    observation.planes =
        (0..take_count(bytes)?).map(|_| DetectedPlane::take_bytes(bytes)).collect::<Option<_>>()?;
    (bytes.is_empty() && images.is_empty()).then_some(observation)
}

fn put_camera(camera: &PinholeCamera, out: &mut Vec<u8>) {
    put_count(camera.width(), out);
    put_count(camera.height(), out);
    for value in [camera.fx(), camera.fy(), camera.cx(), camera.cy()] {
        out.put_f64_le(value);
    }
}

fn take_camera(bytes: &mut &[u8]) -> Option<PinholeCamera> {
    let (width, height) = (take_count(bytes)?, take_count(bytes)?);
    let mut next = || bytes.try_get_f64_le().ok();
    PinholeCamera::new(width, height, next()?, next()?, next()?, next()?).ok()
}

fn put_mask(mask: &Mask, out: &mut Vec<u8>) {
    (0..mask.height()).flat_map(|v| mask.row_words(v)).for_each(|&word| out.put_u64_le(word));
}

fn take_mask(bytes: &mut &[u8], [width, height]: [usize; 2]) -> Option<Mask> {
    let count = width.div_ceil(64) * height;
    let words = bytes.get(..8 * count)?.chunks_exact(8).map(|mut word| word.get_u64_le()).collect();
    bytes.advance(8 * count);
    Mask::from_words(width, height, words).ok()
}

fn put_detection(detection: &Detection, out: &mut Vec<u8>) {
    put_count(detection.label().len(), out);
    out.put_slice(detection.label().as_bytes());
    let around = detection.bounding_box();
    for value in [detection.score(), around.x_min(), around.y_min(), around.x_max(), around.y_max()] {
        out.put_f32_le(value);
    }
    out.put_u8(detection.mask().is_some().into());
    if let Some(mask) = detection.mask() {
        put_mask(mask, out);
    }
}

fn take_detection(bytes: &mut &[u8], size: [usize; 2]) -> Option<Detection> {
    let length = take_count(bytes)?;
    let (label, rest) = bytes.split_at_checked(length)?;
    let label = std::str::from_utf8(label).ok()?;
    *bytes = rest;
    let mut next = || bytes.try_get_f32_le().ok();
    let score = next()?;
    let around = BoundingBox::new(next()?, next()?, next()?, next()?).ok()?;
    let detection = Detection::new(label, score, around).ok()?;
    Some(match bytes.try_get_u8().ok()? {
        0 => detection,
        _ => detection.with_mask(take_mask(bytes, size)?),
    })
}

fn take_point(bytes: &mut &[u8]) -> Option<SightedPoint> {
    let id = bytes.try_get_u64_le().ok()?;
    let mut next = || bytes.try_get_f32_le().ok();
    Some(SightedPoint::new(id, [next()?, next()?]))
}

fn put_count(count: usize, out: &mut Vec<u8>) {
    out.put_u32_le(count as u32);
}

fn take_count(bytes: &mut &[u8]) -> Option<usize> {
    bytes.try_get_u32_le().ok().map(|count| count as usize)
}

#[cfg(test)]
mod tests {
    use dymlm_core::{ColorImage, DepthImage, Frame, SensorModel};
    use dymlm_planes::{PlaneDetector, PlaneDetectorConfig};

    use super::*;

    fn observation() -> Observation {
        let camera = PinholeCamera::new(150, 110, 131.0, 131.0, 74.5, 54.5).unwrap();
        let depth = |i: usize| {
            let ray_y = ((i / 150) as f32 - 54.5) / 131.0;
            if ray_y > 0.25 { 0.5 / ray_y } else { 2.0 }
        };
        let depth = DepthImage::new(150, 110, (0..150 * 110).map(depth).collect()).unwrap();
        let color = (0..150 * 110).map(|i| [(i % 150) as u8, (i / 150) as u8, (i % 7) as u8]).collect();
        let color = ColorImage::new(150, 110, color).unwrap();
        let frame = Frame::new(12.25, camera, depth, Some(color)).unwrap();
        let mut observation = Observation::of_frame(&frame).unwrap();
        observation.static_mask.fill_row(50, 20..60, false);
        observation.mover_mask.fill_row(50, 25..55, true);
        observation.unproven_mask.fill_row(3, 0..9, true);
        let around = BoundingBox::new(20.0, 50.0, 60.0, 51.0).unwrap();
        let person = Detection::new("person", 0.75, around).unwrap();
        let cup =
            Detection::new("cup \u{2615}", 1.0, around).unwrap().with_mask(observation.mover_mask.clone());
        observation.detections = Some(vec![person, cup]);
        observation.sighted_points = vec![SightedPoint::new(u64::MAX, [1.5, 2.5])];
        let mut detector =
            PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
        observation.planes = detector.detect(&observation.frame, None, &[]).unwrap().to_vec();
        observation
    }

    #[test]
    fn what_is_mapped_comes_back_to_the_bit() {
        let whole = observation();
        assert_eq!(whole.planes.len(), 2);
        let mut buffers = PackingBuffers::default();
        let packed = pack(&whole, &mut buffers);
        assert!(unpack(&packed).as_ref() == Some(&whole));

        let mut bare = Observation::of_frame(
            &Frame::new(0.0, *whole.frame.camera(), whole.frame.depth().clone(), None).unwrap(),
        )
        .unwrap();
        assert!(unpack(&pack(&bare, &mut buffers)).as_ref() == Some(&bare));
        bare.detections = Some(Vec::new());
        assert_eq!(unpack(&pack(&bare, &mut buffers)).unwrap().detections, Some(Vec::new()));
        // Nothing of another observation stays in the buffers.
        assert!(pack(&whole, &mut buffers) == packed);
    }

    #[test]
    fn damage_is_noticed() {
        let packed = pack(&observation(), &mut PackingBuffers::default());
        for place in (0..packed.len()).step_by(37) {
            assert!(unpack(&packed[..place]).is_none());
            let mut damaged = packed.clone();
            damaged[place] ^= 0x10;
            assert!(unpack(&damaged).is_none(), "byte {place} of {}", packed.len());
        }
    }
}

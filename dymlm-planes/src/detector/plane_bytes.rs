use bytes::{Buf, BufMut};
use dymlm_core::Plane;

use super::covariance::PlaneCovariance;
use super::detected_plane::DetectedPlane;
use super::plane_samples::{PlaneSamples, RayLattice};
use crate::moments::Moments;

/// Storage of detected planes as bytes with their key frame; reading restores the same bits.
impl DetectedPlane {
    /// Appends the plane to `out`: some 300 bytes, and about one for each sample.
    pub fn put_bytes(&self, out: &mut Vec<u8>) {
        let PlaneCovariance { axes, centroid, tilt, offset } = self.covariance;
        let Moments { weight, first, second } = self.moments;
        put_all(out, self.plane.normal());
        put_all(out, [self.plane.d(), self.mse, self.area, offset, weight]);
        for values in [self.centroid, axes[0], axes[1], centroid, tilt, first] {
            put_all(out, values);
        }
        put_all(out, second);
        out.put_u32_le(self.support as u32);
        out.put_u32_le(self.inliers as u32);
        out.put_u16_le(self.label);
        self.samples.put_bytes(out);
    }

    /// Reads a plane from the front of `bytes`; `None` when they are not what [`Self::put_bytes`] writes.
    pub fn take_bytes(bytes: &mut &[u8]) -> Option<Self> {
        let normal = take_all(bytes)?;
        let [d, mse, area, offset, weight] = take_all(bytes)?;
        let [own_centroid, u, v, centroid, tilt, first] = take_each(|| take_all(bytes))?;
        let second = take_all(bytes)?;
        let [support, inliers] = take_each(|| bytes.try_get_u32_le().ok())?;
        Some(Self {
            plane: Plane::of_unit_normal(normal, d)?,
            centroid: own_centroid,
            covariance: PlaneCovariance { axes: [u, v], centroid, tilt, offset },
            mse,
            support: support as usize,
            inliers: inliers as usize,
            area,
            label: bytes.try_get_u16_le().ok()?,
            samples: PlaneSamples::take_bytes(bytes)?,
            moments: Moments { weight, first, second },
        })
    }
}

impl PlaneSamples {
    fn put_bytes(&self, out: &mut Vec<u8>) {
        let RayLattice { first, step, columns } = self.lattice;
        first.into_iter().chain(step).for_each(|value| out.put_f32_le(value));
        out.put_u32_le(columns);
        out.put_u32_le(self.places.len() as u32);
        // Most places follow directly after the previous one, which costs one byte.
        let mut next = 0;
        for &place in &self.places {
            put_varint(out, place.wrapping_sub(next));
            next = place.wrapping_add(1);
        }
    }

    fn take_bytes(bytes: &mut &[u8]) -> Option<Self> {
        let [a, b, c, d] = take_each(|| bytes.try_get_f32_le().ok())?;
        let [columns, count] = take_each(|| bytes.try_get_u32_le().ok())?;
        let count = count as usize;
        // A place takes at least one byte, so damaged counts do not cause large allocations.
        let mut places = Vec::with_capacity(Some(count).filter(|&count| count <= bytes.len())?);
        let mut next = 0_u32;
        for _ in 0..count {
            let place = take_varint(bytes)?.wrapping_add(next);
            places.push(place);
            next = place.wrapping_add(1);
        }
        Self::checked(RayLattice { first: [a, b], step: [c, d], columns }, places)
    }
}

fn put_all<const N: usize>(out: &mut Vec<u8>, values: [f64; N]) {
    for value in values {
        out.put_f64_le(value);
    }
}

fn take_all<const N: usize>(bytes: &mut &[u8]) -> Option<[f64; N]> {
    take_each(|| bytes.try_get_f64_le().ok())
}

fn take_each<T: Copy + Default, const N: usize>(mut take: impl FnMut() -> Option<T>) -> Option<[T; N]> {
    let mut all = [T::default(); N];
    for one in &mut all {
        *one = take()?;
    }
    Some(all)
}

/// Seven bits per byte, the lowest first.
fn put_varint(out: &mut Vec<u8>, mut value: u32) {
    while value >= 0x80 {
        out.put_u8(value as u8 | 0x80);
        value >>= 7;
    }
    out.put_u8(value as u8);
}

fn take_varint(bytes: &mut &[u8]) -> Option<u32> {
    let mut value = 0;
    for shift in (0..35).step_by(7) {
        let byte = bytes.try_get_u8().ok()?;
        value |= u32::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, Frame, PinholeCamera, SensorModel};

    use super::super::plane_samples::{MOST_COLUMNS, MOST_SITES};
    use super::*;
    use crate::{PlaneDetector, PlaneDetectorConfig};

    #[test]
    fn planes_come_back_to_the_bit_and_damaged_ones_do_not() {
        let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
        let depth = |i: usize| {
            let ray_y = ((i / 160) as f32 - 59.5) / 131.0;
            if ray_y > 0.25 { 0.5 / ray_y } else { 2.0 }
        };
        let depth = DepthImage::new(160, 120, (0..160 * 120).map(depth).collect()).unwrap();
        let frame = Frame::new(0.0, camera, depth, None).unwrap();
        let mut detector =
            PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
        let planes = detector.detect(&frame, None, &[]).unwrap();
        assert_eq!(planes.len(), 2);

        let mut bytes = Vec::new();
        for plane in planes {
            plane.put_bytes(&mut bytes);
        }
        let mut rest = bytes.as_slice();
        let again: Vec<_> = std::iter::from_fn(|| DetectedPlane::take_bytes(&mut rest)).collect();
        assert_eq!(again, planes);
        for end in 0..bytes.len() {
            let mut cut = &bytes[..end];
            let whole = std::iter::from_fn(|| DetectedPlane::take_bytes(&mut cut)).count();
            assert!(whole < 2, "{end} of {}", bytes.len());
        }
    }

    #[test]
    fn samples_that_no_detector_makes_are_refused() {
        let lattice = RayLattice { first: [-0.5, -0.4], step: [0.03, 0.03], columns: 40 };
        let read = |lattice, places: &[u32]| {
            let mut bytes = Vec::new();
            PlaneSamples { lattice, places: places.to_vec() }.put_bytes(&mut bytes);
            PlaneSamples::take_bytes(&mut bytes.as_slice())
        };
        let last = MOST_SITES as u32 - 1;
        for places in [&[][..], &[0], &[0, 1, 7], &[last]] {
            assert_eq!(read(lattice, places).map(|samples| samples.places), Some(places.to_vec()));
        }
        for places in [&[1, 0][..], &[7, 7], &[last + 1], &[u32::MAX], &[u32::MAX, 0]] {
            assert_eq!(read(lattice, places), None, "{places:?}");
        }
        for columns in [0, MOST_COLUMNS as u32 + 1, u32::MAX] {
            assert_eq!(read(RayLattice { columns, ..lattice }, &[0]), None, "{columns} columns");
        }
        for value in [f32::NAN, f32::INFINITY] {
            assert_eq!(read(RayLattice { first: [0.0, value], ..lattice }, &[0]), None);
            assert_eq!(read(RayLattice { step: [value, 0.0], ..lattice }, &[0]), None);
        }
    }

    #[cfg(feature = "serde")]
    #[test]
    fn samples_from_json_are_checked_as_those_from_bytes() {
        let samples = PlaneSamples {
            lattice: RayLattice { first: [-0.5, -0.5], step: [0.25, 0.25], columns: 4 },
            places: vec![1, 5],
        };
        let json = serde_json::to_string(&samples).unwrap();
        assert_eq!(serde_json::from_str::<PlaneSamples>(&json).unwrap(), samples);
        for places in ["[5,1]", "[1,1]", "[4294967295]"] {
            let wrong = json.replace("[1,5]", places);
            assert_ne!(wrong, json);
            assert!(serde_json::from_str::<PlaneSamples>(&wrong).is_err(), "{places}");
        }
    }
}

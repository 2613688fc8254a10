use dymlm_core::vector3::{Vector3, cross, difference, norm};

/// Bins on each side of the faces of a cube around the sensor: in the middle of a face they are 1.3 degrees
/// wide.
const BINS: i32 = 90;
/// From how many bins away on a ray's neighbours are looked for, since a ring lies in two bins of a column,
/// ...
const NEXT: i32 = 2;
/// ... and how far: farther than the rings of most lidars are apart (those of 16 rings two degrees).
const REACH: i32 = 6;

/// The nearest reading of a scan in each direction, which tells how flatly rays meet what they read.
///
/// A ray that ends far behind a reading beside it may end on the surface that this one is on: a lidar on a
/// robot reads the floor in rings, metres apart, and a ray that descends by 3 degrees is for the last 80 cm
/// less than a cell of the evidence above it. What it passes there is no free space. Only along the surface's
/// normal the tolerance tells what a ray has passed.
#[derive(Debug, Clone, Default)]
pub(super) struct NearestReadings {
    /// By face and bin: from the sensor to the reading, metres; 0 where nothing was read.
    readings: Vec<Vector3>,
}

impl NearestReadings {
    pub(super) fn clear(&mut self) {
        self.readings.clear();
        self.readings.resize((6 * BINS * BINS) as usize, [0.0; 3]);
    }

    /// Notes a reading, given from the sensor.
    pub(super) fn note(&mut self, reading: Vector3) {
        let [face, u, v] = bin_of(reading);
        let nearest = &mut self.readings[index(face, u, v)];
        if *nearest == [0.0; 3] || norm(reading) < norm(*nearest) {
            *nearest = reading;
        }
    }

    /// The least sine of the angle at which the ray to `end` may meet a surface that is also on a reading
    /// beside the ray. Readings that are less than `noise` metres nearer tell nothing.
    pub(super) fn sine_of_incidence(&self, end: Vector3, noise: f64) -> f64 {
        let ([face, u, v], range) = (bin_of(end), norm(end));
        let neighbour = |[du, dv]: [i32; 2]| {
            let readings = (NEXT..=REACH).map(|step| {
                let [face, u, v] = bin_of(middle_of(face, u + step * du, v + step * dv));
                self.readings[index(face, u, v)]
            });
            readings.into_iter().find(|reading| *reading != [0.0; 3])
        };
        let neighbours = [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().filter_map(neighbour);
        let nearer = neighbours.filter(|neighbour| norm(*neighbour) < range - noise);
        let sine = |neighbour: Vector3| {
            let across = difference(end, neighbour);
            norm(cross(across, end)) / (norm(across) * range)
        };
        nearer.map(sine).fold(1.0, f64::min)
    }
}

/// The face of the cube that a direction points through, and the bin on it.
fn bin_of(direction: Vector3) -> [i32; 3] {
    let lengths = direction.map(f64::abs);
    let axis = if lengths[0] >= lengths[1] && lengths[0] >= lengths[2] {
        0
    } else {
        1 + usize::from(lengths[2] > lengths[1])
    };
    let bin = |c: f64| ((0.5 * f64::from(BINS) * (1.0 + c / lengths[axis])) as i32).clamp(0, BINS - 1);
    let [u, v] = [direction[(axis + 1) % 3], direction[(axis + 2) % 3]].map(bin);
    [2 * axis as i32 + i32::from(direction[axis] < 0.0), u, v]
}

/// The direction of the middle of a bin, which may be beside the face.
fn middle_of(face: i32, u: i32, v: i32) -> Vector3 {
    let axis = (face / 2) as usize;
    let mut direction = [0.0; 3];
    direction[axis] = if face % 2 == 0 { 1.0 } else { -1.0 };
    for (next, bin) in [(1, u), (2, v)] {
        direction[(axis + next) % 3] = (2.0 * f64::from(bin) + 1.0) / f64::from(BINS) - 1.0;
    }
    direction
}

fn index(face: i32, u: i32, v: i32) -> usize {
    ((face * BINS + u) * BINS + v) as usize
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    #[test]
    fn bins_are_found_from_their_middles_on_all_faces() {
        for face in 0..6 {
            for (u, v) in [(0, 0), (0, BINS - 1), (BINS - 1, 3), (44, 45)] {
                assert_eq!(bin_of(middle_of(face, u, v)), [face, u, v]);
            }
            // Beside a face lies another one.
            assert_ne!(bin_of(middle_of(face, BINS + 2, 40))[0], face);
        }
    }

    #[test]
    fn a_floor_is_met_as_flatly_as_it_is_and_a_wall_is_not() {
        let mut readings = NearestReadings::default();
        readings.clear();
        // Rings on a floor 0.6 m below, and on a wall at 4 m.
        let ray = |degrees: f64, azimuth: f64| {
            let (elevation, azimuth) = (degrees.to_radians(), azimuth.to_radians());
            let direction =
                [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
            let floor = if direction[2] < 0.0 { -0.6 / direction[2] } else { f64::INFINITY };
            let wall = if direction[1] > 0.0 { 4.0 / direction[1] } else { f64::INFINITY };
            direction.map(|c| c * floor.min(wall))
        };
        for ring in 0..16 {
            for step in 0..720 {
                let reading = ray(f64::from(2 * ring) - 15.0, 0.5 * f64::from(step));
                if norm(reading) < 50.0 {
                    readings.note(reading);
                }
            }
        }
        let mut random = SplitMix64::new(3);
        for _ in 0..200 {
            let azimuth = 190.0 + 160.0 * random.fraction();
            for degrees in [-3.0_f64, -5.0, -9.0] {
                let sine = readings.sine_of_incidence(ray(degrees, azimuth), 0.04);
                let truth = -degrees.to_radians().sin();
                assert!((0.5 * truth..1.6 * truth).contains(&sine), "{sine} at {degrees} degrees");
            }
            let ahead = 80.0 + 20.0 * random.fraction();
            assert!(readings.sine_of_incidence(ray(1.0, ahead), 0.04) > 0.9);
        }
    }
}

use crate::{Frame, SensorModel};

/// How far around a pixel readings of its surface are averaged, pixels: 25 readings leave a fifth of the
/// noise. A smaller window leaves more of the error that is to be removed, a larger one costs more and rounds
/// off what stands before a far wall.
const REACH: usize = 2;
/// Readings of a row that are averaged together, as processors do it several at a time.
const RUN: usize = 32;
/// Means are rounded to this fraction of a metre, less than a tenth of the noise of any depth camera at the end
/// of its range: a depth image with few values is packed well.
const STEPS: f32 = 1024.0;

impl Frame {
    /// Averages the readings near the farthest depth that a sensor is used to, so that the whole of a surface
    /// is within the range or none of it.
    ///
    /// Only readings up to [`max_depth`](SensorModel::max_depth) are used. Of a surface that is nearer to this
    /// limit than its noise is wide, they would be those whose error leads towards the camera: a wall at the
    /// limit would be mapped up to a standard deviation before its place, 6 cm with a stereo pair at 4 m, and
    /// a wall behind the limit before it. So a reading becomes the mean of the readings around it that are
    /// readings of the same surface, where this mean is within the sensor's tolerance of the limit. All other
    /// readings stay as they are. O(pixels), and 25 times as much near the limit.
    ///
    /// `readings` is a buffer, which is used again from call to call.
    pub fn average_range_end(&mut self, sensor: &SensorModel, readings: &mut Vec<f32>) {
        let end = RangeEnd::of(sensor);
        readings.clear();
        readings.extend_from_slice(self.depth().data());
        let (width, height) = (self.depth().width(), self.depth().height());
        let before = Readings { width, height, depths: readings };
        for (v, row) in self.depth_mut().data_mut().chunks_exact_mut(width).enumerate() {
            for (run, depths) in row.chunks_mut(RUN).enumerate() {
                if depths.iter().any(|&z| end.is_near(z)) {
                    end.average(&before, [run * RUN, v], depths);
                }
            }
        }
    }

    /// Whether [`average_range_end`](Self::average_range_end) may change a reading.
    pub fn reaches_range_end(&self, sensor: &SensorModel) -> bool {
        let end = RangeEnd::of(sensor);
        // Blocks of pixels without an early end, which take a few instructions a pixel.
        let mut blocks = self.depth().data().chunks(1024);
        blocks.any(|block| block.iter().fold(false, |any, &z| any | end.is_near(z)))
    }
}

/// The end of a sensor's range.
#[derive(Debug, Clone, Copy)]
struct RangeEnd {
    max_depth: f32,
    /// How far a reading at the limit may lie from its surface, metres.
    tolerance: f32,
}

/// The readings of an image as they came.
struct Readings<'a> {
    width: usize,
    height: usize,
    depths: &'a [f32],
}

impl RangeEnd {
    fn of(sensor: &SensorModel) -> Self {
        Self { max_depth: sensor.max_depth, tolerance: sensor.tolerance(sensor.max_depth, 0.0) as f32 }
    }

    /// Whether a reading may be of a surface within the tolerance of the limit.
    #[inline]
    fn is_near(self, z: f32) -> bool {
        z > 0.0 && (z - self.max_depth).abs() <= 2.0 * self.tolerance
    }

    /// Replaces those of a run of readings, which begins at pixel (u, v), that are near the limit by the mean of
    /// the readings of their surface, if it is within the tolerance of the limit.
    fn average(self, readings: &Readings<'_>, [u, v]: [usize; 2], depths: &mut [f32]) {
        let own: [f32; RUN] = std::array::from_fn(|i| depths.get(i).copied().unwrap_or(0.0));
        // The difference of two readings errs by the square root of two as much as one.
        let same = std::f32::consts::SQRT_2 * self.tolerance;
        // Differences are added up, so that readings among equal ones stay what they are.
        let (mut sums, mut counts) = ([0.0_f32; RUN], [0.0_f32; RUN]);
        for row in v.saturating_sub(REACH)..(v + REACH + 1).min(readings.height) {
            let around = readings.around(u, row);
            for others in around.windows(RUN) {
                let terms: [(f32, f32); RUN] = std::array::from_fn(|i| {
                    let difference = others[i] - own[i];
                    let is_same = (others[i] > 0.0) & (difference.abs() <= same);
                    if is_same { (difference, 1.0) } else { (0.0, 0.0) }
                });
                sums = std::array::from_fn(|i| sums[i] + terms[i].0);
                counts = std::array::from_fn(|i| counts[i] + terms[i].1);
            }
        }
        for ((depth, sum), count) in depths.iter_mut().zip(sums).zip(counts) {
            if self.is_near(*depth) && sum != 0.0 {
                let mean = ((*depth + sum / count) * STEPS).round() / STEPS;
                *depth = if (mean - self.max_depth).abs() <= self.tolerance { mean } else { *depth };
            }
        }
    }
}

impl Readings<'_> {
    /// The readings of a row from [`REACH`] before column `u` to as far behind a run; 0 outside the image.
    fn around(&self, u: usize, row: usize) -> [f32; RUN + 2 * REACH] {
        let row = &self.depths[row * self.width..(row + 1) * self.width];
        let inside = u.checked_sub(REACH).and_then(|first| row.get(first..)?.first_chunk());
        if let Some(around) = inside {
            return *around;
        }
        let reading = |column: usize| column.checked_sub(REACH).and_then(|column| row.get(column)).copied();
        std::array::from_fn(|i| reading(u + i).unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DepthImage, PinholeCamera, SplitMix64};

    /// The mean of those readings of a wall that are used, and their number.
    fn used(wall: f32, sensor: &SensorModel, is_averaged: bool) -> (f64, usize) {
        let mut random = SplitMix64::new(5);
        // The sum of twelve fractions has a variance of 1.
        let mut normal = || (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0;
        let depths = (0..160 * 120).map(|_| wall + sensor.sigma(wall) * normal() as f32).collect();
        let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
        let mut frame = Frame::new(0.0, camera, DepthImage::new(160, 120, depths).unwrap(), None).unwrap();
        if is_averaged {
            frame.average_range_end(sensor, &mut Vec::new());
        }
        let used: Vec<f64> =
            frame.depth().data().iter().filter(|z| sensor.is_used(**z)).map(|&z| z.into()).collect();
        (used.iter().sum::<f64>() / used.len().max(1) as f64, used.len())
    }

    #[test]
    fn a_wall_near_the_end_of_the_range_is_used_where_it_stands_or_not_at_all() {
        let sensor = SensorModel::realsense_d4xx();
        let error = |wall: f32, is_averaged: bool| used(wall, &sensor, is_averaged).0 - f64::from(wall);
        assert!(error(3.97, false) < -0.03, "the test shows nothing");
        for wall in [3.7, 3.8, 3.85, 3.9, 3.95, 3.97] {
            assert!(error(wall, true).abs() < 0.01, "{wall}: {}", error(wall, true));
        }
        let (_, before) = used(4.05, &sensor, false);
        let (_, after) = used(4.05, &sensor, true);
        assert!(before > 3000 && after < 20, "{before}, {after}");
    }

    #[test]
    fn readings_elsewhere_and_even_readings_stay_as_they_are() {
        let sensor = SensorModel::realsense_d4xx();
        let camera = PinholeCamera::new(64, 48, 52.0, 52.0, 31.5, 23.5).unwrap();
        for depths in [vec![3.99; 64 * 48], (0..64 * 48).map(|i| [0.0, 1.0, 3.0, 5.0][i % 4]).collect()] {
            let depth = DepthImage::new(64, 48, depths).unwrap();
            let mut frame = Frame::new(0.0, camera, depth.clone(), None).unwrap();
            frame.average_range_end(&sensor, &mut Vec::new());
            assert_eq!(frame.depth(), &depth);
        }
    }
}

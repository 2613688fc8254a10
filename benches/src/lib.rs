//! Seeded inputs that the benches share.

mod resident_bytes;

pub use resident_bytes::resident_bytes;

use dymlm_core::{DepthImage, PinholeCamera, Point};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Numbers of points with which benches run.
pub const SIZES: [usize; 3] = [10_000, 100_000, 1_000_000];

/// The seed of every bench's input.
pub const SEED: u64 = 7;

/// `n` points in Gaussian-like blobs of 20 cm, one blob per 1000 points, in a cube of side cbrt(n / 1000)
/// metres (so that the density does not depend on n), with 5 % of uniform noise.
pub fn blobs(n: usize) -> Vec<Point> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let blob_count = (n / 1000).max(1);
    let side = (blob_count as f32).cbrt();
    let mut uniform_point = |side: f32| -> Point { std::array::from_fn(|_| rng.random_range(0.0..side)) };
    let centers: Vec<Point> = (0..blob_count).map(|_| uniform_point(side)).collect();
    (0..n)
        .map(|i| {
            if i % 20 == 0 {
                return uniform_point(side);
            }
            let center = centers[i % blob_count];
            // The sum of three uniform offsets is nearly normally distributed.
            let offsets = [uniform_point(0.2), uniform_point(0.2), uniform_point(0.2)];
            std::array::from_fn(|axis| {
                center[axis] + offsets.iter().map(|offset| offset[axis] - 0.1).sum::<f32>()
            })
        })
        .collect()
}

/// `n` points on the faces of a box of 60 x 40 x 30 cm, rotated in the room, with 2 mm of noise and 1 % of
/// stray points around it.
pub fn thing(n: usize) -> Vec<Point> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let lengths = [0.6, 0.4, 0.3_f32];
    let (sin, cos) = 0.4_f32.sin_cos();
    (0..n)
        .map(|i| {
            let mut local: Point = std::array::from_fn(|axis| rng.random_range(-0.5..0.5) * lengths[axis]);
            if i % 100 == 0 {
                local = local.map(|x| 1.5 * x);
            } else {
                let side = if i % 2 == 0 { 0.5 } else { -0.5 };
                local[i % 3] = side * lengths[i % 3] + rng.random_range(-0.002..0.002);
            }
            let [x, y, z] = local;
            [1.0 + cos * x - sin * y, 2.0 + sin * x + cos * y, 1.0 + z]
        })
        .collect()
}

/// The x and y of the points of [`thing`].
pub fn footprint(n: usize) -> Vec<[f64; 2]> {
    thing(n).iter().map(|[x, y, _]| [f64::from(*x), f64::from(*y)]).collect()
}

/// The camera of a 640x480 Kinect.
///
/// # Panics
///
/// Never: the constants are a valid camera's.
#[allow(clippy::unwrap_used, reason = "constants")]
pub fn kinect() -> PinholeCamera {
    kinect_of_width(640).unwrap()
}

/// A camera with a Kinect's field of view and so many columns of pixels.
///
/// # Errors
///
/// The camera's, where it would have no pixel.
pub fn kinect_of_width(width: usize) -> Result<PinholeCamera, dymlm_core::Error> {
    let height = width * 3 / 4;
    let focal_length = 525.0 / 640.0 * width as f64;
    let [cx, cy] = [width, height].map(|side| (side as f64 - 1.0) / 2.0);
    PinholeCamera::new(width, height, focal_length, focal_length, cx, cy)
}

/// A depth frame of a corner of a room: floor, two walls, a table, with noise and missing pixels.
///
/// # Panics
///
/// Never: the buffer has the camera's size.
#[allow(clippy::unwrap_used, reason = "constants")]
pub fn room_depth() -> DepthImage {
    let camera = kinect();
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut data = Vec::with_capacity(camera.width() * camera.height());
    for v in 0..camera.height() {
        for u in 0..camera.width() {
            let [x, y, _] = camera.back_project([u as f64, v as f64], 1.0);
            let back_wall = 4.0_f64;
            let side_wall = if x > 0.0 { 1.6 / x } else { f64::INFINITY };
            let floor = if y > 0.0 { 1.2 / y } else { f64::INFINITY };
            let table = if y > 0.0 && (1.2..2.4).contains(&(0.5 / y)) && x.abs() < 0.4 {
                0.5 / y
            } else {
                f64::INFINITY
            };
            let z = back_wall.min(side_wall).min(floor).min(table) as f32;
            let noise = dymlm_core::DepthNoise::kinect().sigma(z)
                * (rng.random_range(-1.0..1.0_f32) + rng.random_range(-1.0..1.0_f32));
            data.push(if rng.random_range(0.0..1.0) < 0.05 { 0.0 } else { z + noise });
        }
    }
    DepthImage::new(camera.width(), camera.height(), data).unwrap()
}

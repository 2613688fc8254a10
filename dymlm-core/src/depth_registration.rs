use crate::{DepthImage, Error, PinholeCamera, Pose};

/// Brings the readings of a depth camera into the image of a colour camera beside it, so that both images of
/// a frame belong to one camera.
///
/// Each reading covers there the area of its pixel, so that a colour image of more pixels has no holes; where
/// several readings cover one pixel, the nearest counts. Surfaces that the depth camera does not see, because
/// something nearer is in the way, have no reading. O(pixels of the depth image, and of what they cover).
///
/// ```
/// use dymlm_core::{DepthImage, DepthRegistration, PinholeCamera, Pose};
///
/// let depth_camera = PinholeCamera::new(320, 240, 260.0, 260.0, 159.5, 119.5)?;
/// let color_camera = PinholeCamera::new(640, 480, 520.0, 520.0, 319.5, 239.5)?;
/// // The colour camera is 5 cm to the left of the depth camera.
/// let color_from_depth = Pose::new([0.05, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?;
/// let registration = DepthRegistration::new(&depth_camera, &color_camera, &color_from_depth);
///
/// let mut registered = DepthImage::empty(640, 480)?;
/// registration.register(&DepthImage::new(320, 240, vec![2.0; 320 * 240])?, &mut registered)?;
/// assert_eq!(registered.at(320, 240), 2.0);
/// assert_eq!(registered.at(5, 240), 0.0, "13 pixels at the left lie outside the depth image");
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone)]
#[doc(alias = "extrinsics")]
#[doc(alias = "align_depth")]
pub struct DepthRegistration {
    depth_camera: PinholeCamera,
    color_camera: PinholeCamera,
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
    /// What each column and each row adds to a pixel's ray, in the colour camera's frame.
    columns: Vec<[f64; 3]>,
    rows: Vec<[f64; 3]>,
    /// How much a ray changes from a pixel to the next, along u and v.
    ray_steps: [f64; 2],
}

/// Size of the area that a reading covers, relative to its pixel. On a slope, neighbouring pixels of the
/// depth image move apart in the colour image: at 1.0, one pixel in twenty of a wall seen aslant has no
/// reading (test: `a_slope_has_no_holes`). At 2.0, near things grow by half a pixel over what is behind them
/// (test: `one_camera_registered_to_itself_changes_nothing`).
const COVERAGE: f64 = 1.25;

/// Depth below which no camera sees a surface, metres: a reading at the colour camera's very centre would
/// cover its whole image.
const NEAREST: f64 = 0.01;

impl DepthRegistration {
    /// A registration of one camera's images to another camera; `color_from_depth` takes points of the first
    /// camera's frame to the second's.
    #[must_use]
    pub fn new(depth_camera: &PinholeCamera, color_camera: &PinholeCamera, color_from_depth: &Pose) -> Self {
        let rotation = color_from_depth.rotation_matrix();
        let [across, down] = [0, 1].map(|axis| rotation.map(|row| row[axis]));
        let forward = rotation.map(|row| row[2]);
        let column = |u: usize| across.map(|c| c * (u as f64 - depth_camera.cx()) / depth_camera.fx());
        let row = |v: usize| {
            let y = (v as f64 - depth_camera.cy()) / depth_camera.fy();
            std::array::from_fn(|axis| down[axis] * y + forward[axis])
        };
        Self {
            depth_camera: *depth_camera,
            color_camera: *color_camera,
            rotation,
            translation: color_from_depth.translation(),
            columns: (0..depth_camera.width()).map(column).collect(),
            rows: (0..depth_camera.height()).map(row).collect(),
            ray_steps: [1.0 / depth_camera.fx(), 1.0 / depth_camera.fy()],
        }
    }

    /// The camera of the registered images.
    pub fn camera(&self) -> &PinholeCamera {
        &self.color_camera
    }

    /// Registers a depth image. `registered` gets the colour camera's size; with an image of that size
    /// nothing is allocated.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when `depth` is not of the depth camera's size.
    pub fn register(&self, depth: &DepthImage, registered: &mut DepthImage) -> Result<(), Error> {
        self.depth_camera.check_size("the depth image", depth.width(), depth.height())?;
        let (width, height) = (self.color_camera.width(), self.color_camera.height());
        registered.replace(width, height, std::iter::repeat_n(0.0, width * height));
        let pixels = registered.data_mut();
        for (row, depths) in self.rows.iter().zip(depth.data().chunks_exact(depth.width())) {
            for (column, &z) in self.columns.iter().zip(depths).filter(|&(_, &z)| z > 0.0) {
                let ray = [0, 1, 2].map(|axis| column[axis] + row[axis]);
                let Some(reading) = self.reading(ray, z.into()) else { continue };
                let columns = pixels_within(reading.bounds[0], width);
                for row in pixels_within(reading.bounds[1], height).map(|row| row * width) {
                    for pixel in &mut pixels[row + columns.start..row + columns.end] {
                        *pixel = if *pixel > 0.0 { pixel.min(reading.depth) } else { reading.depth };
                    }
                }
            }
        }
        Ok(())
    }

    /// What a reading covers in the colour image; `None` when it is behind the colour camera or at it.
    #[inline]
    fn reading(&self, ray: [f64; 3], z: f64) -> Option<Footprint> {
        let (to, rotation) = (&self.color_camera, &self.rotation);
        let [x, y, depth] = [0, 1, 2].map(|axis| ray[axis] * z + self.translation[axis]);
        if !(NEAREST..=f64::from(f32::MAX)).contains(&depth) {
            return None;
        }
        let inverse = 1.0 / depth;
        let (x, y) = (x * inverse, y * inverse);
        let center = [to.fx() * x + to.cx(), to.fy() * y + to.cy()];
        // How the place in the colour image moves with the pixel, along u and v.
        let steps = self.ray_steps.map(|step| z * inverse * step);
        let half_extent = |focal: f64, axis: usize, slope: f64| {
            let moved =
                |step: usize| ((rotation[axis][step] - slope * rotation[2][step]) * steps[step]).abs();
            0.5 * COVERAGE * focal.abs() * (moved(0) + moved(1))
        };
        let half = [half_extent(to.fx(), 0, x), half_extent(to.fy(), 1, y)];
        let bounds = [0, 1].map(|axis| [center[axis] - half[axis], center[axis] + half[axis]]);
        Some(Footprint { bounds, depth: depth as f32 })
    }
}

/// What a reading covers: its bounds along u and along v, and its depth there.
struct Footprint {
    bounds: [[f64; 2]; 2],
    depth: f32,
}

/// Pixels whose centres lie within [low, high). (Casts saturate.)
#[inline]
fn pixels_within(sides: [f64; 2], count: usize) -> std::ops::Range<usize> {
    // Not `f64::ceil`, which is a function call on many processors.
    let ceil = |side: f64| {
        let whole = side as i32;
        whole.saturating_add(i32::from(side > f64::from(whole)))
    };
    // At most 2^28 pixels are in a row.
    let [start, end] = sides.map(|side| ceil(side).clamp(0, count as i32) as usize);
    start..end.max(start)
}

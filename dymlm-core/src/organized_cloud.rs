use crate::{DepthImage, Error, PinholeCamera, Point};

/// The points of a depth image in the camera frame, one per pixel, row by row. A point with z = 0 is no
/// reading.
///
/// A buffer to reuse: filled again for each frame, it allocates once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OrganizedCloud {
    width: usize,
    height: usize,
    points: Vec<Point>,
    /// (u - cx) / fx of each column; kept so that a frame allocates nothing.
    ray_x: Vec<f32>,
}

impl OrganizedCloud {
    /// An empty cloud, to be filled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Back-projects every pixel: x = (u - cx) / fx z, y = (v - cy) / fy z.
    ///
    /// Costs about what it takes to write the points: no branch on missing readings, which become (0, 0, 0).
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when the image is of another size than the camera; the cloud stays as it was.
    ///
    /// ```
    /// use dymlm_core::{DepthImage, OrganizedCloud, PinholeCamera};
    ///
    /// let camera = PinholeCamera::new(3, 1, 2.0, 2.0, 1.0, 0.0)?;
    /// let mut cloud = OrganizedCloud::new();
    /// cloud.back_project(&camera, &DepthImage::new(3, 1, vec![4.0, 0.0, 6.0])?)?;
    /// assert_eq!(cloud.points(), [[-2.0, 0.0, 4.0], [0.0, 0.0, 0.0], [3.0, 0.0, 6.0]]);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn back_project(&mut self, camera: &PinholeCamera, depth: &DepthImage) -> Result<(), Error> {
        camera.check_size("the depth image", depth.width(), depth.height())?;
        let (width, height) = (camera.width(), camera.height());
        (self.width, self.height) = (width, height);
        self.ray_x.clear();
        self.ray_x.extend((0..width).map(|u| ((u as f64 - camera.cx()) / camera.fx()) as f32));
        self.points.resize(width * height, [0.0; 3]);

        let rows = self.points.chunks_exact_mut(width).zip(depth.data().chunks_exact(width));
        for (v, (points, depths)) in rows.enumerate() {
            let ray_y = ((v as f64 - camera.cy()) / camera.fy()) as f32;
            for ((point, &z), &ray_x) in points.iter_mut().zip(depths).zip(&self.ray_x) {
                *point = [ray_x * z, ray_y * z, z];
            }
        }
        Ok(())
    }

    /// Width, pixels.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All points, row by row; z = 0 where there is no reading.
    #[inline]
    pub fn points(&self) -> &[Point] {
        &self.points
    }
}

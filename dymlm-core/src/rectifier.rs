use crate::{BoundingBox, ColorImage, DepthImage, Detection, Distortion, Error, Mask, PinholeCamera};

/// Turns the images of a lens with distortion into those of a pinhole camera: depth by the nearest pixel,
/// colour bilinearly.
///
/// The place of each pixel in the raw image is computed once; a frame then allocates nothing and costs one
/// look-up per pixel. Depth along the optical axis is the same in both images.
///
/// ```
/// use dymlm_core::{DepthImage, Distortion, PinholeCamera, Rectifier};
///
/// let camera = PinholeCamera::new(640, 480, 517.3, 516.5, 318.6, 255.3)?;
/// let lens = Distortion::brown_conrady(&[0.2624, -0.9531, -0.0054, 0.0026, 1.1633])?;
/// let rectifier = Rectifier::new(&camera, &lens, &camera);
///
/// let raw = DepthImage::new(640, 480, vec![2.0; 640 * 480])?;
/// let mut depth = DepthImage::empty(640, 480)?;
/// rectifier.rectify_depth(&raw, &mut depth)?;
/// assert_eq!(depth.at(320, 240), 2.0);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone)]
#[doc(alias = "undistort")]
#[doc(alias = "remap")]
pub struct Rectifier {
    raw: PinholeCamera,
    distortion: Distortion,
    camera: PinholeCamera,
    places: Vec<Place>,
}

/// Halvings of a box in search of the end of what a lens model describes: to a hundredth of a pixel.
const BISECTIONS: usize = 17;

/// Where a pixel lies in the raw image.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Index of the nearest raw pixel; [`NOWHERE`] when the pixel lies outside the raw image.
    nearest: u32,
    /// Index of the raw pixel at the upper left of the place.
    corner: u32,
    /// How far the place is on the way to the next column and to the next row, in 1/256.
    across: u16,
    down: u16,
}

const NOWHERE: u32 = u32::MAX;

impl Rectifier {
    /// A rectifier from the images of a lens (`raw` has their size and the lens's focal lengths and principal
    /// point) to those of `camera`, which may be the same or have another size and focal length. O(pixels).
    #[must_use]
    pub fn new(raw: &PinholeCamera, distortion: &Distortion, camera: &PinholeCamera) -> Self {
        let limit = distortion.largest_radius_squared();
        let place = |u: usize, v: usize| {
            let [x, y, _] = camera.back_project([u as f64, v as f64], 1.0);
            let [x, y] =
                distortion.distort([x, y]).map(|c| if x * x + y * y <= limit { c } else { f64::NAN });
            let pixel = raw.project([x, y, 1.0]).filter(|&pixel| raw.sees(pixel));
            pixel.map_or(Place { nearest: NOWHERE, corner: 0, across: 0, down: 0 }, |pixel| at(raw, pixel))
        };
        let pixels = (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v)));
        let places = pixels.map(|(u, v)| place(u, v)).collect();
        Self { raw: *raw, distortion: *distortion, camera: *camera, places }
    }

    /// The camera of the rectified images.
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }

    /// Rectifies a depth image; where `raw` shows nothing there is no reading. `depth` gets the camera's
    /// size.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when `raw` is not of the raw camera's size.
    pub fn rectify_depth(&self, raw: &DepthImage, depth: &mut DepthImage) -> Result<(), Error> {
        self.raw.check_size("the raw depth image", raw.width(), raw.height())?;
        let readings = raw.data();
        depth.replace(
            self.camera.width(),
            self.camera.height(),
            self.places.iter().map(|place| readings.get(place.nearest as usize).copied().unwrap_or(0.0)),
        );
        Ok(())
    }

    /// Rectifies a colour image; where `raw` shows nothing it is black. `color` gets the camera's size.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when `raw` is not of the raw camera's size.
    pub fn rectify_color(&self, raw: &ColorImage, color: &mut ColorImage) -> Result<(), Error> {
        self.raw.check_size("the raw colour image", raw.width(), raw.height())?;
        let (width, pixels) = (raw.width(), raw.data());
        let black = [0; 3];
        let pixel = |place: &Place| {
            if place.nearest == NOWHERE {
                return black;
            }
            // On the last column or row, `across` or `down` is 0: no pixel beyond it is read.
            let of = |index: usize| pixels.get(index).copied().unwrap_or(black);
            let corner = place.corner as usize;
            let (across, down) = (u32::from(place.across), u32::from(place.down));
            let right = usize::from(across > 0);
            let below = if down > 0 { width } else { 0 };
            let quad = [corner, corner + right, corner + below, corner + below + right].map(of);
            std::array::from_fn(|channel| {
                let [a, b, c, d] = quad.map(|pixel| u32::from(pixel[channel]));
                let upper = a * (256 - across) + b * across;
                let lower = c * (256 - across) + d * across;
                ((upper * (256 - down) + lower * down + (1 << 15)) >> 16) as u8
            })
        };
        color.replace(self.camera.width(), self.camera.height(), self.places.iter().map(pixel));
        Ok(())
    }

    /// Rectifies a mask, by the nearest pixel; `false` where `raw` shows nothing. `mask` gets the camera's
    /// size.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when `raw` is not of the raw camera's size.
    pub fn rectify_mask(&self, raw: &Mask, mask: &mut Mask) -> Result<(), Error> {
        self.raw.check_size("the raw mask", raw.width(), raw.height())?;
        let width = self.camera.width();
        mask.refill(width, self.camera.height(), false)?;
        for (index, place) in self.places.iter().enumerate().filter(|(_, place)| place.nearest != NOWHERE) {
            let nearest = place.nearest as usize;
            mask.set(index % width, index / width, raw.at(nearest % raw.width(), nearest / raw.width()));
        }
        Ok(())
    }

    /// Where a pixel of the raw image lies in the rectified ones, inside them or not; `None` outside the part
    /// of the image that the lens model describes.
    #[must_use]
    pub fn rectify_point(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y, _] = self.raw.back_project(pixel, 1.0);
        let [x, y] = self.distortion.undistort([x, y])?;
        self.camera.project([x, y, 1.0])
    }

    /// The smallest box that holds the border of a box of the raw image, sampled in 32 places; `None` when
    /// the lens shows nothing there. Where the border lies outside the part of the image that the lens model
    /// describes, the end of that part takes its place, or the rectified image's border before it.
    #[must_use]
    pub fn rectify_box(&self, bounding_box: &BoundingBox) -> Option<BoundingBox> {
        let sides = <[f32; 4]>::from(*bounding_box).map(f64::from);
        let [x_min, y_min, x_max, y_max] = sides;
        let between = |a: f64, b: f64, step: usize| a + (b - a) * step as f64 / 8.0;
        let border = (0..=8).flat_map(|step| {
            let (x, y) = (between(x_min, x_max, step), between(y_min, y_max, step));
            [[x, y_min], [x, y_max], [x_min, y], [x_max, y]]
        });
        // What the model describes lies around the principal point. Where it does not describe the place of
        // the box that is nearest to that, it describes none of the box.
        let nearest = [self.raw.cx().clamp(x_min, x_max), self.raw.cy().clamp(y_min, y_max)];
        self.rectify_point(nearest)?;
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for [x, y] in border.filter_map(|place| self.rectify_toward(place, nearest)) {
            bounds = [bounds[0].min(x), bounds[1].min(y), bounds[2].max(x), bounds[3].max(y)];
        }
        BoundingBox::try_from(bounds.map(|side| side as f32)).ok()
    }

    /// Rectifies a place of the raw image. Where the lens model does not describe it, the last place that it
    /// does describe, on the line from another one (`other`) to this, takes its place.
    fn rectify_toward(&self, place: [f64; 2], other: [f64; 2]) -> Option<[f64; 2]> {
        let along = |share: f64| [0, 1].map(|axis| place[axis] + share * (other[axis] - place[axis]));
        if let Some(rectified) = self.rectify_point(place) {
            return Some(rectified);
        }
        let (mut without, mut with) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = f64::midpoint(without, with);
            let is_inside = self.rectify_point(along(middle)).is_some();
            *if is_inside { &mut with } else { &mut without } = middle;
        }
        // A lens of 180 degrees has its end at infinity.
        let [x, y] = self.rectify_point(along(with))?;
        Some([x.clamp(0.0, self.camera.width() as f64), y.clamp(0.0, self.camera.height() as f64)])
    }

    /// A detection in the raw image as one in the rectified image; `None` when the lens shows nothing there,
    /// or its mask is of another size than the raw image.
    #[must_use]
    pub fn rectify_detection(&self, raw: &Detection) -> Option<Detection> {
        let bounding_box = self.rectify_box(&raw.bounding_box())?;
        let rectified = Detection::new(raw.label(), raw.score(), bounding_box).ok()?;
        let Some(raw_mask) = raw.mask() else { return Some(rectified) };
        let mut mask = raw_mask.clone();
        self.rectify_mask(raw_mask, &mut mask).ok()?;
        Some(rectified.with_mask(mask))
    }
}

/// The place of a position on the raw image, pixels.
fn at(raw: &PinholeCamera, pixel: [f64; 2]) -> Place {
    let size = [raw.width(), raw.height()];
    let inside = [0, 1].map(|axis| pixel[axis].clamp(0.0, (size[axis] - 1) as f64));
    let nearest = inside.map(|c| c.round() as usize);
    // In 1/256 pixels.
    let fine = inside.map(|c| (c * 256.0).round() as usize);
    let corner = fine.map(|c| c / 256);
    Place {
        nearest: (nearest[1] * size[0] + nearest[0]) as u32,
        corner: (corner[1] * size[0] + corner[0]) as u32,
        across: (fine[0] % 256) as u16,
        down: (fine[1] % 256) as u16,
    }
}

use dymlm_core::BoundingBox;
use rustfft::FftNum;
use rustfft::num_complex::Complex;
use rustfft::num_traits::Zero;

use super::alignment::Alignment;
use super::channels::{COUNT, Channels, PLANES};
use super::config::{KcfConfig, PUBLISHED};
use super::correlation::KernelCorrelation;
use super::fourier::Fourier;
use super::lanes::Lanes;
use super::peak::Peak;
use super::transform::fast_length;
use super::window::WindowSampler;
use crate::{Error, GrayImage};

/// Least side of the target's part on the image, pixels.
const LEAST_SIDE: f32 = 6.0;
/// Weight lambda of the regularization (Henriques 2015).
const REGULARIZATION: f32 = 1e-4;
/// Ratio between the scales that are tried, as in the authors' multi-scale program.
const SCALE_STEP: f32 = 1.05;
/// Largest correction of the response's peak by the target's own pixels, cells: on what the filter has found,
/// its peak is never off by more.
const FARTHEST_ALIGNED: f32 = 0.5;
/// Factor on the response at another scale than the current one: the size only changes when another fits
/// clearly better.
const SCALE_WEIGHT: f32 = 0.98;
/// Least peak-to-sidelobe ratio at which a view is learned. At lower ratios the target is probably occluded,
/// and the occluder must not be learned.
const LEAST_LEARNING_RATIO: f32 = 5.0;

/// Tracks a window of the image by a kernelized correlation filter.
///
/// Henriques, Caseiro, Martins, Batista: "High-Speed Tracking with Kernelized Correlation Filters", TPAMI
/// 2015: kernel ridge regression over all cyclic shifts of a padded window, learned and evaluated in the
/// frequency domain. The window is resampled to a template of fixed size; neighbouring scales are tried to
/// follow the target's size. Aligning the target's own pixels with the learned ones gives the last fraction
/// of a pixel.
///
/// An update costs O(s n log n) for s scales and n cells, and O(pixels of the window); it does not allocate.
/// The model begins with the first view and slowly adapts to new ones. The tracker cannot find a target that
/// has left its window.
///
/// ```
/// use dymlm_core::BoundingBox;
/// use dymlm_tracking::{GrayImage, KcfConfig, KcfTracker};
///
/// // A textured square that moves by (5, 3).
/// let view = |x: usize, y: usize| {
///     let value = |i: usize| {
///         let (u, v) = (i % 160, i / 160);
///         let inside = (x..x + 32).contains(&u) && (y..y + 32).contains(&v);
///         if inside { ((u - x) * (v - y) % 7) as f32 / 7.0 } else { 0.5 }
///     };
///     GrayImage::new(160, 120, (0..160 * 120).map(value).collect())
/// };
/// let mut tracker =
///     KcfTracker::new(&view(60, 40)?, BoundingBox::new(60.0, 40.0, 92.0, 72.0)?, &KcfConfig::default())?;
/// let update = tracker.update(&view(65, 43)?);
/// let [u, v] = update.bounding_box.center();
/// assert!((u - 81.0).abs() < 1.0 && (v - 59.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct KcfTracker {
    config: KcfConfig,
    /// Centre of the target in box coordinates, which are pixel coordinates plus half a pixel.
    center: [f32; 2],
    /// Size of the target at scale 1, pixels.
    size: [f32; 2],
    first_box: BoundingBox,
    scale: f32,
    /// Number of cells of the template, across and down.
    cells: [usize; 2],
    peak_radius: usize,
    /// Transforms of single planes, and of the channels' packed planes.
    fourier: Fourier<f32>,
    packed_fourier: Fourier<Lanes>,
    channels: Channels,
    correlation: KernelCorrelation,
    /// Spectrum of the wanted response.
    wanted: Vec<Complex<f32>>,
    /// The model: packed spectra of the target's channels, and of the dual coefficients.
    appearance: Vec<Complex<Lanes>>,
    coefficients: Vec<Complex<f32>>,
    /// The learned view at full resolution, for the last fraction of a cell.
    alignment: Alignment,
    scratch: Scratch,
}

/// Working memory of an update.
#[derive(Debug, Clone)]
struct Scratch {
    sampler: WindowSampler,
    template: Vec<f32>,
    view: Vec<Complex<Lanes>>,
    response: Vec<Complex<f32>>,
}

/// The target as [`KcfTracker`] found it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct KcfUpdate {
    /// The target's box, pixels; parts of it may lie outside the image.
    pub bounding_box: BoundingBox,
    /// Size relative to the first box.
    pub scale: f32,
    /// Height of the response's peak; 1 for a view equal to the learned ones.
    pub peak: f32,
    /// Height of the peak above the rest of the response, in standard deviations of the rest (Bolme 2010):
    /// the confidence. It is above about 8 for a fully visible target; below 5 the target is probably
    /// occluded or lost.
    pub peak_to_sidelobe: f32,
    /// Whether the view was learned: not when the peak does not stand out enough, and never by
    /// [`KcfTracker::locate`].
    pub is_learned: bool,
}

impl KcfTracker {
    /// Begins to track the content of the box.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::TargetSize`] when less than 6x6 pixels of the target lie on the image.
    pub fn new(image: &GrayImage, target: BoundingBox, config: &KcfConfig) -> Result<Self, Error> {
        config.validate()?;
        check_target(image, target)?;
        let size = [target.width(), target.height()];
        let cells = template_cells(size, config);
        let cell = PUBLISHED.cell;
        let count = cells[0] * cells[1];
        let mut fourier = Fourier::new(cells);
        let channels = Channels::new(cells);
        let spectra = PLANES * count;
        // The target takes 1 / padding of the template's width and height.
        let sigma = (count as f32).sqrt() / config.padding * PUBLISHED.output_sigma;
        let mut tracker = Self {
            config: config.clone(),
            center: target.center(),
            size,
            first_box: target,
            scale: 1.0,
            cells,
            peak_radius: (3.0 * sigma).ceil() as usize,
            correlation: KernelCorrelation::new(count, COUNT, PUBLISHED.kernel_sigma),
            wanted: wanted_response(cells, sigma, &mut fourier),
            fourier,
            packed_fourier: Fourier::new(cells),
            channels,
            appearance: vec![Complex::zero(); spectra],
            coefficients: vec![Complex::zero(); count],
            alignment: Alignment::new(size),
            scratch: Scratch {
                sampler: WindowSampler::default(),
                template: vec![0.0; count * cell * cell],
                view: vec![Complex::zero(); spectra],
                response: vec![Complex::zero(); count],
            },
        };
        tracker.learn_at_rate(image, 1.0);
        Ok(tracker)
    }

    /// Finds the target in the next image, and learns its view there if it is clearly visible.
    pub fn update(&mut self, image: &GrayImage) -> KcfUpdate {
        let mut update = self.locate(image);
        if update.peak_to_sidelobe >= LEAST_LEARNING_RATIO {
            self.learn(image);
            update.is_learned = true;
        }
        update
    }

    /// Finds the target in an image and moves there without learning. The target's centre stays on the image.
    pub fn locate(&mut self, image: &GrayImage) -> KcfUpdate {
        let mut found = self.detect(image, self.scale);
        // Far from the middle of the window, the taper draws the peak inwards. The search is repeated with
        // the target near the middle.
        if found.shift[0].abs().max(found.shift[1].abs()) >= 1.0 {
            self.shift_by(&found, self.scale, image);
            found = self.detect(image, self.scale);
        }
        self.shift_by(&found, self.scale, image);
        self.align(image);
        if let Some((peak, scale)) = self.better_scale(image, &found) {
            self.shift_by(&peak, scale, image);
            self.scale = scale;
            self.align(image);
            found = peak;
        }
        KcfUpdate {
            bounding_box: self.bounding_box(),
            scale: self.scale,
            peak: found.value,
            peak_to_sidelobe: found.sidelobe_ratio,
            is_learned: false,
        }
    }

    /// The peak at a neighbouring scale that fits clearly better, with that scale.
    fn better_scale(&mut self, image: &GrayImage, found: &Peak) -> Option<(Peak, f32)> {
        let mut best = None;
        let mut least = found.value / SCALE_WEIGHT;
        for other in [self.scale / SCALE_STEP, self.scale * SCALE_STEP] {
            let other = self.allowed_scale(other, image);
            let peak = self.detect(image, other);
            if peak.value > least {
                (best, least) = (Some((peak, other)), peak.value);
            }
        }
        // `found` had the target off the middle of its window: the old scale is measured again for
        // comparison.
        best.filter(|(peak, _)| peak.value * SCALE_WEIGHT > self.detect(image, self.scale).value)
    }

    /// Learns the target's view in an image at its current place.
    pub fn learn(&mut self, image: &GrayImage) {
        self.learn_at_rate(image, PUBLISHED.learning_rate);
    }

    /// Sets the target's place from outside knowledge; the learned model is kept. The box keeps its first
    /// ratio of width to height and takes the area of `target`.
    ///
    /// # Errors
    ///
    /// [`Error::TargetSize`] when less than 6x6 pixels of the box lie on the image.
    pub fn move_to(&mut self, image: &GrayImage, target: BoundingBox) -> Result<(), Error> {
        check_target(image, target)?;
        self.center = target.center();
        let ratio = f64::from(target.width()) * f64::from(target.height())
            / (f64::from(self.size[0]) * f64::from(self.size[1]));
        self.scale = self.allowed_scale(ratio.sqrt() as f32, image);
        Ok(())
    }

    /// The target's box as last found.
    pub fn bounding_box(&self) -> BoundingBox {
        let half = self.size.map(|side| 0.5 * side * self.scale);
        let [u, v] = self.center;
        let sides = [u - half[0], v - half[1], u + half[0], v + half[1]];
        // Never refused: centre and size are finite and positive by construction.
        BoundingBox::try_from(sides).unwrap_or(self.first_box)
    }

    /// Moves the target by a peak's shift.
    fn shift_by(&mut self, peak: &Peak, scale: f32, image: &GrayImage) {
        let extent = self.window_extent(scale);
        let shift = [0, 1].map(|axis| peak.shift[axis] * extent[axis] / self.cells[axis] as f32);
        self.move_by(shift, image);
    }

    /// Moves to the place that the target's own pixels give, if it is within half a cell.
    fn align(&mut self, image: &GrayImage) {
        let extent = self.window_extent(self.scale);
        let cell = (extent[0] / self.cells[0] as f32).max(extent[1] / self.cells[1] as f32);
        let (center, size) = (self.pixel_center(), self.size.map(|side| side * self.scale));
        if let Some(shift) = self.alignment.align(image, center, size, FARTHEST_ALIGNED * cell) {
            self.move_by(shift, image);
        }
    }

    /// Moves by a shift in pixels, at most to the image's border; a centre that is beyond it already, as of
    /// a target that the border cuts, stays as far out.
    fn move_by(&mut self, shift: [f32; 2], image: &GrayImage) {
        let limits = [image.width() as f32, image.height() as f32];
        for axis in 0..2 {
            let center = self.center[axis];
            self.center[axis] = (center + shift[axis]).clamp(center.min(0.0), center.max(limits[axis]));
        }
    }

    /// The centre in pixel coordinates: box coordinates minus half a pixel.
    fn pixel_center(&self) -> [f32; 2] {
        self.center.map(|c| c - 0.5)
    }

    /// The response to the window of a given scale at the target's place.
    fn detect(&mut self, image: &GrayImage, scale: f32) -> Peak {
        self.observe(image, scale);
        let response = &mut self.scratch.response;
        self.correlation.correlate(&self.appearance, &self.scratch.view, &mut self.fourier, response);
        let norm = 1.0 / response.len() as f32;
        for (value, coefficient) in response.iter_mut().zip(&self.coefficients) {
            *value *= coefficient * norm;
        }
        self.fourier.inverse(response);
        Peak::find(response, self.cells, self.peak_radius)
    }

    /// Ridge regression in the frequency domain (eq. 17); the result is blended into the model.
    fn learn_at_rate(&mut self, image: &GrayImage, rate: f32) {
        self.observe(image, self.scale);
        let kernel = &mut self.scratch.response;
        let view = &self.scratch.view;
        self.correlation.correlate(view, view, &mut self.fourier, kernel);
        for (value, wanted) in kernel.iter_mut().zip(&self.wanted) {
            *value = wanted / (*value + REGULARIZATION);
        }
        blend(&mut self.coefficients, kernel, rate, 1.0 - rate);
        blend(&mut self.appearance, view, Lanes::splat(rate), Lanes::splat(1.0 - rate));
        let (center, size) = (self.pixel_center(), self.size.map(|side| side * self.scale));
        self.alignment.learn(image, center, size, rate);
    }

    /// Computes the spectra of the window of a given scale, into `scratch.view`.
    fn observe(&mut self, image: &GrayImage, scale: f32) {
        let extent = self.window_extent(scale);
        let size = self.cells.map(|count| count * PUBLISHED.cell);
        let center = self.pixel_center();
        let Scratch { sampler, template, view, .. } = &mut self.scratch;
        sampler.sample(image, center, extent, size, template);
        self.channels.compute(template, view);
        self.packed_fourier.forward(view);
    }

    fn window_extent(&self, scale: f32) -> [f32; 2] {
        self.size.map(|side| side * self.config.padding * scale)
    }

    /// Limits a scale so that the target is larger than the least side and smaller than twice the image.
    fn allowed_scale(&self, scale: f32, image: &GrayImage) -> f32 {
        let least = LEAST_SIDE / self.size[0].min(self.size[1]);
        let most = 2.0 * (image.width() as f32 / self.size[0]).min(image.height() as f32 / self.size[1]);
        scale.min(most.max(1.0)).max(least.min(1.0))
    }
}

fn check_target(image: &GrayImage, target: BoundingBox) -> Result<(), Error> {
    let visible = target.clipped(image.width(), image.height());
    let [visible_width, visible_height] = visible.map_or([0.0; 2], |part| [part.width(), part.height()]);
    // Boxes much larger than the image would overflow later, and contain no target either.
    let absurd = 100.0 * image.width().max(image.height()) as f32;
    let is_absurd = target.width() > absurd || target.height() > absurd;
    if visible_width < LEAST_SIDE || visible_height < LEAST_SIDE || is_absurd {
        return Err(Error::TargetSize { visible_width, visible_height, least: LEAST_SIDE });
    }
    Ok(())
}

/// Number of cells of the template: the longer side as configured, the other in proportion, both fast to
/// transform.
fn template_cells(size: [f32; 2], config: &KcfConfig) -> [usize; 2] {
    let longer = size[0].max(size[1]);
    size.map(|side| {
        let cells = (side / longer * config.template_size as f32 / PUBLISHED.cell as f32).round() as usize;
        fast_length(cells.max(6))
    })
}

/// Spectrum of a Gaussian of `sigma` cells around no shift.
fn wanted_response(cells: [usize; 2], sigma: f32, fourier: &mut Fourier<f32>) -> Vec<Complex<f32>> {
    let cyclic = |i: usize, count: usize| i.min(count - i) as f32;
    let mut response: Vec<Complex<f32>> = (0..cells[0] * cells[1])
        .map(|i| {
            let [x, y] = [cyclic(i % cells[0], cells[0]), cyclic(i / cells[0], cells[1])];
            Complex::new((-0.5 * (x * x + y * y) / (sigma * sigma)).exp(), 0.0)
        })
        .collect();
    fourier.forward(&mut response);
    response
}

fn blend<T: FftNum>(model: &mut [Complex<T>], new: &[Complex<T>], new_share: T, old_share: T) {
    for (value, new) in model.iter_mut().zip(new) {
        *value = *value * old_share + new * new_share;
    }
}

use super::window::WindowSampler;
use crate::GrayImage;

/// Largest number of samples along a side; larger targets are sampled at larger steps.
const MOST_SAMPLES: f32 = 48.0;
const FEWEST_SAMPLES: f32 = 6.0;
/// Largest number of steps; most targets need three.
const MOST_STEPS: usize = 8;
/// A step below this many samples ends the alignment.
const LEAST_STEP: f32 = 0.01;
/// Least correlation with the learned view at which the target is accepted. Lower values mean that something
/// else is there, or that the target has turned.
const LEAST_CORRELATION: f32 = 0.7;
/// Least ratio of the smaller to the larger eigenvalue of the gradients' moments: along a mere edge, the view
/// could slide. (Determinant over squared trace, which is about this ratio when it is small.)
const LEAST_CORNERNESS: f32 = 1e-3;

/// Finds a target to a fraction of a pixel. The filter's response is only known once per cell, and a parabola
/// between cells is a guess.
///
/// Gauss-Newton steps on squared differences align the target's own pixels with the learned ones, independent
/// of brightness and contrast. Baker, Matthews: "Lucas-Kanade 20 Years On", IJCV 56, 2004 (inverse
/// compositional, translation).
#[derive(Debug, Clone)]
pub(super) struct Alignment {
    /// Number of samples across and down.
    size: [usize; 2],
    sampler: WindowSampler,
    /// Weight of each sample; weights fall to 0 at the border, where the background begins.
    weights: Vec<f32>,
    /// The learned view, of weighted mean 0 and length 1.
    appearance: Vec<f32>,
    view: Vec<f32>,
}

impl Alignment {
    /// For targets of a given size in pixels.
    pub(super) fn new(target: [f32; 2]) -> Self {
        let size = target.map(|side| side.clamp(FEWEST_SAMPLES, MOST_SAMPLES).round() as usize);
        let count = size[0] * size[1];
        let weight = |i: usize, count: usize| {
            let place = (2 * i + 1) as f32 / count as f32 - 1.0;
            1.0 - place * place
        };
        let weights =
            (0..count).map(|i| weight(i % size[0], size[0]) * weight(i / size[0], size[1])).collect();
        let zeros = vec![0.0; count];
        Self { size, sampler: WindowSampler::default(), weights, appearance: zeros.clone(), view: zeros }
    }

    /// Blends the view of a target around `center`, `extent` pixels large, into the learned view.
    pub(super) fn learn(&mut self, image: &GrayImage, center: [f32; 2], extent: [f32; 2], rate: f32) {
        self.look(image, center, extent);
        for (known, new) in self.appearance.iter_mut().zip(&self.view) {
            *known = *known * (1.0 - rate) + new * rate;
        }
        normalize(&mut self.appearance, &self.weights);
    }

    /// The target's shift from `center`, pixels; `None` when it exceeds `most` on an axis or the target is
    /// not there.
    pub(super) fn align(
        &mut self,
        image: &GrayImage,
        center: [f32; 2],
        extent: [f32; 2],
        most: f32,
    ) -> Option<[f32; 2]> {
        let moments = self.moments()?;
        let step = [0, 1].map(|axis| extent[axis] / self.size[axis] as f32);
        let mut shift = [0.0_f32; 2];
        for _ in 0..MOST_STEPS {
            self.look(image, [center[0] + shift[0], center[1] + shift[1]], extent);
            let samples = self.step(moments);
            shift = [0, 1].map(|axis| shift[axis] + samples[axis] * step[axis]);
            let is_near = shift.iter().all(|moved| moved.abs() <= most);
            if !is_near {
                return None;
            }
            if samples[0].abs().max(samples[1].abs()) < LEAST_STEP {
                break;
            }
        }
        (self.correlation() >= LEAST_CORRELATION).then_some(shift)
    }

    /// Samples and normalizes the view around a place, into `view`.
    fn look(&mut self, image: &GrayImage, center: [f32; 2], extent: [f32; 2]) {
        self.sampler.sample(image, center, extent, self.size, &mut self.view);
        normalize(&mut self.view, &self.weights);
    }

    fn correlation(&self) -> f32 {
        let products = self.view.iter().zip(&self.appearance).zip(&self.weights);
        products.map(|((view, known), weight)| weight * view * known).sum()
    }

    /// Moments xx, xy and yy of the learned view's gradients; `None` when they do not fix both directions.
    fn moments(&self) -> Option<[f32; 3]> {
        let mut moments = [0.0; 3];
        self.for_each_gradient(|i, [dx, dy]| {
            let weight = self.weights[i];
            moments[0] += weight * dx * dx;
            moments[1] += weight * dx * dy;
            moments[2] += weight * dy * dy;
        });
        let [xx, xy, yy] = moments;
        let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
        (determinant > LEAST_CORNERNESS * trace * trace).then_some(moments)
    }

    /// The step that brings the view towards the learned view, samples, to first order.
    fn step(&self, [xx, xy, yy]: [f32; 3]) -> [f32; 2] {
        let (mut x, mut y) = (0.0, 0.0);
        self.for_each_gradient(|i, [dx, dy]| {
            let difference = self.weights[i] * (self.appearance[i] - self.view[i]);
            x += dx * difference;
            y += dy * difference;
        });
        let determinant = xx * yy - xy * xy;
        [(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant]
    }

    /// Passes the gradient of the learned view at each sample to `take`, except at the border.
    #[inline]
    fn for_each_gradient(&self, mut take: impl FnMut(usize, [f32; 2])) {
        let [width, height] = self.size;
        for y in 1..height - 1 {
            for i in y * width + 1..(y + 1) * width - 1 {
                let dx = 0.5 * (self.appearance[i + 1] - self.appearance[i - 1]);
                let dy = 0.5 * (self.appearance[i + width] - self.appearance[i - width]);
                take(i, [dx, dy]);
            }
        }
    }
}

/// Removes brightness and contrast from a view; a view without contrast becomes 0.
fn normalize(view: &mut [f32], weights: &[f32]) {
    let total: f32 = weights.iter().sum();
    let mean = view.iter().zip(weights).map(|(value, weight)| weight * value).sum::<f32>() / total;
    let squares: f32 = view.iter().zip(weights).map(|(value, weight)| weight * (value - mean).powi(2)).sum();
    let scale = if squares > f32::EPSILON && squares.is_finite() { 1.0 / squares.sqrt() } else { 0.0 };
    for value in view {
        *value = if scale > 0.0 { (*value - mean) * scale } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(shift: [f32; 2], contrast: f32) -> GrayImage {
        let value = |i: usize| {
            let [u, v] = [(i % 80) as f32 - shift[0], (i / 80) as f32 - shift[1]];
            0.4 + contrast * ((0.4 * u).sin() * (0.3 * v + 0.1 * u).cos() + 0.5 * (0.23 * v).sin())
        };
        GrayImage::new(80, 60, (0..80 * 60).map(value).collect()).unwrap()
    }

    #[test]
    fn finds_fractions_of_a_pixel_at_any_contrast() {
        let (center, extent) = ([40.0, 30.0], [30.0, 24.0]);
        let mut alignment = Alignment::new(extent);
        alignment.learn(&image([0.0; 2], 0.2), center, extent, 1.0);
        for shift in [[0.0, 0.0], [0.3, -0.4], [1.2, 0.9], [-1.5, 0.25]] {
            for contrast in [0.2, 0.05] {
                let found = alignment.align(&image(shift, contrast), center, extent, 2.0).unwrap();
                assert!((0..2).all(|axis| (found[axis] - shift[axis]).abs() < 0.03), "{found:?} {shift:?}");
            }
        }
        assert_eq!(alignment.align(&image([1.2, 0.9], 0.2), center, extent, 0.5), None);
    }

    #[test]
    fn what_has_no_texture_or_is_another_thing_is_not_aligned() {
        let (center, extent) = ([40.0, 30.0], [30.0, 24.0]);
        let flat = GrayImage::new(80, 60, vec![0.5; 80 * 60]).unwrap();
        let edge =
            GrayImage::new(80, 60, (0..80 * 60).map(|i| (0.2 * (i % 80) as f32).sin()).collect()).unwrap();
        let mut alignment = Alignment::new(extent);
        for known in [&flat, &edge] {
            alignment.learn(known, center, extent, 1.0);
            assert_eq!(alignment.align(known, center, extent, 2.0), None);
        }
        alignment.learn(&image([0.0; 2], 0.2), center, extent, 1.0);
        assert_eq!(alignment.align(&flat, center, extent, 2.0), None);
        assert_eq!(alignment.align(&edge, center, extent, 2.0), None);
    }
}

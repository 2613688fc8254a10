use wide::f32x4;

use super::config::Lighting;
use super::gradient_sums::{GradientSums, add_gradients};
use super::sampling::{Interpolated, bilinear, is_within, nearest, region};
use super::shifted_sums::{LANES, ShiftedSums, sum_of, vectors};
use crate::GrayImage;

/// Most values of a row with its padding: those of the widest window.
const MOST_COLUMNS: usize = 32;

/// A window of an image with its gradients, which is searched in another image: one level of Lucas-Kanade.
///
/// Gradients are computed once, from the window itself (Bouguet 2000; Baker, Matthews 2004). The sums with
/// the other image ([`ShiftedSums`]) are computed once for each pixel that the search reaches, not once per
/// iteration. Rows are padded with pixels of no gradient and no weight.
#[derive(Debug, Clone, Default)]
pub(crate) struct Template {
    radius: usize,
    /// Values per row, with padding.
    stride: usize,
    /// Grey values minus their mean; 0 in the padding. They and their sums are computed when first needed:
    /// only brightness that may change, and the last comparison, need them.
    values: Vec<f32>,
    gradient_u: Vec<f32>,
    gradient_v: Vec<f32>,
    /// 1 in the window, 0 in the padding and where a mask excludes pixels.
    weights: Vec<f32>,
    /// Number of pixels with weight 1, and whether `weights` may differ from the full window.
    pixels: f32,
    is_masked: bool,
    /// Two brightness slopes over the window, orthonormal and of mean 0; used if `is_level`.
    slopes: [Vec<f32>; 2],
    is_level: bool,
    gradient_sums: GradientSums,
    value_sums: Option<ValueSums>,
    /// The sampled window with a rim of one pixel, and 0 in the padding, in rows of `stride` + [`LANES`].
    sampled: Vec<f32>,
    /// Working memory for parts of the image with a repeated border.
    patch: Vec<f32>,
}

/// Sums with the values of the window that are the same in all iterations.
#[derive(Debug, Clone, Copy, Default)]
struct ValueSums {
    mean: f32,
    /// Sum of the squared values minus their mean.
    energy: f32,
    gradient: [f32; 2],
    gradient_value: [f32; 2],
}

/// Where a template was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Alignment {
    pub(crate) point: [f32; 2],
    /// Root mean square difference of the windows, after the allowed change of brightness is removed.
    pub(crate) residual: f32,
    /// Normalized correlation of the windows, -1..=1.
    pub(crate) correlation: f32,
}

/// When an alignment ends, and how brightness may change.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AlignmentLimits {
    pub(crate) iterations: usize,
    pub(crate) epsilon: f32,
    pub(crate) lighting: Lighting,
}

impl Template {
    /// Takes the window of 2 radius + 1 pixels a side around `center`.
    pub(crate) fn take(&mut self, image: &GrayImage, center: [f32; 2], radius: usize) {
        self.resize(radius);
        let side = 2 * radius + 3;
        let columns = side.next_multiple_of(LANES);
        let corner = center.map(|c| c - (radius + 1) as f32);
        let window = Interpolated::new(image, corner, [columns, side], &mut self.patch);
        for (y, row) in self.sampled.chunks_exact_mut(self.stride + LANES).enumerate() {
            window.read(y, row.get_mut(..columns).unwrap_or(&mut []));
        }
        self.count_all();
        self.is_level = false;
        self.value_sums = None;
        self.measure_gradients();
    }

    /// Takes a warped window: its pixel (x, y) from the centre shows `center + a (x, y)` of the image, as the
    /// window will look when the surface has turned. `a` is given by rows. Pixels where `mask`, of the
    /// image's size, is below a half show something else and have no weight.
    ///
    /// On a turned surface, brightness also changes by a slope. Slopes are removed from values and gradients,
    /// so that slopes in the other image have no effect (Hager, Belhumeur 1998; Baker, Matthews 2004, part 3:
    /// project out).
    pub(crate) fn take_warped(
        &mut self,
        image: &GrayImage,
        mask: Option<&GrayImage>,
        center: [f32; 2],
        a: [[f32; 2]; 2],
        radius: usize,
    ) {
        self.resize(radius);
        let reach = (radius + 1) as f32;
        let source =
            |x: f32, y: f32| [center[0] + a[0][0] * x + a[0][1] * y, center[1] + a[1][0] * x + a[1][1] * y];
        let side = 2 * radius + 3;
        for (y, row) in self.sampled.chunks_exact_mut(self.stride + LANES).enumerate() {
            for (x, value) in row.iter_mut().take(side).enumerate() {
                *value = bilinear(image, source(x as f32 - reach, y as f32 - reach));
            }
        }
        self.count_all();
        if let Some(mask) = mask {
            let radius = radius as f32;
            for (y, row) in self.weights.chunks_exact_mut(self.stride).enumerate() {
                for (x, weight) in row.iter_mut().take(side - 2).enumerate() {
                    let shown = nearest(mask, source(x as f32 - radius, y as f32 - radius)).round() > 0.0;
                    *weight = if shown { 1.0 } else { 0.0 };
                }
            }
            self.pixels = self.weights.iter().sum();
            self.is_masked = true;
        }
        self.is_level = true;
        self.measure_gradients();
        self.measure_values();
    }

    /// Share of the window's pixels that have weight, 0..=1.
    pub(crate) fn share(&self) -> f32 {
        let side = (2 * self.radius + 1) as f32;
        self.pixels / (side * side)
    }

    /// The smaller eigenvalue of the mean gradient matrix.
    pub(crate) fn min_eigenvalue(&self) -> f32 {
        let [uu, uv, vv] = self.gradient_sums.matrix.map(|sum| sum / self.pixels.max(1.0));
        0.5 * (uu + vv - ((uu - vv) * (uu - vv) + 4.0 * uv * uv).sqrt())
    }

    /// Finds the template near `start`; `None` when it has no texture or the search leaves the image.
    pub(crate) fn align(
        &mut self,
        image: &GrayImage,
        start: [f32; 2],
        limits: AlignmentLimits,
    ) -> Option<Alignment> {
        let point = self.search(image, start, limits)?;
        Some(self.judge(image, point, limits.lighting))
    }

    /// As [`Self::align`], without comparing the windows at the end.
    pub(crate) fn search(
        &mut self,
        image: &GrayImage,
        start: [f32; 2],
        limits: AlignmentLimits,
    ) -> Option<[f32; 2]> {
        let [uu, uv, vv] = self.gradient_sums.matrix;
        let determinant = uu * vv - uv * uv;
        if determinant <= f32::EPSILON * (uu + vv) * (uu + vv) {
            return None;
        }
        let mut point = start;
        let mut previous = [0.0_f32; 2];
        let mut sums = None;
        for _ in 0..limits.iterations {
            if !is_within(image, point) {
                return None;
            }
            let [bu, bv] = self.mismatch(image, point, limits.lighting, &mut sums)?;
            let step = [(uv * bv - vv * bu) / determinant, (uv * bu - uu * bv) / determinant];
            point = [point[0] + step[0], point[1] + step[1]];
            let squared = step[0] * step[0] + step[1] * step[1];
            if squared <= limits.epsilon * limits.epsilon {
                break;
            }
            // The steps alternate: the minimum lies between the two places.
            if (step[0] + previous[0]).abs() < 0.01 && (step[1] + previous[1]).abs() < 0.01 {
                point = [point[0] - 0.5 * step[0], point[1] - 0.5 * step[1]];
                break;
            }
            previous = step;
        }
        is_within(image, point).then_some(point)
    }

    fn resize(&mut self, radius: usize) {
        let side = 2 * radius + 1;
        let stride = side.next_multiple_of(LANES);
        if radius == self.radius && !self.values.is_empty() {
            return;
        }
        (self.radius, self.stride) = (radius, stride);
        for plane in [&mut self.values, &mut self.gradient_u, &mut self.gradient_v, &mut self.weights] {
            plane.clear();
            plane.resize(side * stride, 0.0);
        }
        self.is_masked = true;
        self.sampled.clear();
        self.sampled.resize((side + 2) * (stride + LANES), 0.0);
    }

    /// Gives weight to all pixels of the window.
    fn count_all(&mut self) {
        if !self.is_masked {
            return;
        }
        let side = 2 * self.radius + 1;
        for row in self.weights.chunks_exact_mut(self.stride) {
            row[..side].fill(1.0);
        }
        self.pixels = (side * side) as f32;
        self.is_masked = false;
    }

    /// Computes the gradients (Scharr) of the sampled window, and their sums.
    fn measure_gradients(&mut self) {
        let rows = self.sampled.chunks_exact(self.stride + LANES);
        let rows = rows.clone().zip(rows.clone().skip(1)).zip(rows.skip(2));
        let targets = self.gradient_u.chunks_exact_mut(self.stride);
        let targets = targets.zip(self.gradient_v.chunks_exact_mut(self.stride));
        let weights = self.weights.chunks_exact(self.stride);
        let mut sums = [f32x4::ZERO; 5];
        for ((((above, here), below), weights), (target_u, target_v)) in rows.zip(weights).zip(targets) {
            add_gradients(&mut sums, [above, here, below], weights, [target_u, target_v]);
        }
        self.gradient_sums = sums.into();
    }

    /// The sums with the values, which are computed when they are asked for first.
    #[inline]
    fn value_sums(&mut self) -> ValueSums {
        match self.value_sums {
            Some(sums) => sums,
            None => self.measure_values(),
        }
    }

    fn measure_values(&mut self) -> ValueSums {
        let rim = self.stride + LANES;
        let mut total = f32x4::ZERO;
        let targets = self.values.chunks_exact_mut(self.stride).zip(self.weights.chunks_exact(self.stride));
        for ((values, weights), row) in targets.zip(self.sampled.chunks_exact(rim).skip(1)) {
            let sampled = vectors(row.get(1..).unwrap_or(&[])).zip(vectors(weights));
            for (value, (seen, weight)) in values.as_chunks_mut::<LANES>().0.iter_mut().zip(sampled) {
                let seen = seen * weight;
                total += seen;
                *value = seen.to_array();
            }
        }
        let mean = sum_of(total) / self.pixels.max(1.0);
        subtract(&mut self.values, &self.weights, mean);
        if self.is_level {
            self.find_slopes();
            self.take_out_slopes();
        }
        let sums = ValueSums::of(mean, &self.values, [&self.gradient_u, &self.gradient_v]);
        if self.is_level {
            self.gradient_sums = GradientSums::of([&self.gradient_u, &self.gradient_v], |axis| {
                sums.gradient_value[axis] + mean * sums.gradient[axis]
            });
        }
        *self.value_sums.insert(sums)
    }

    /// x and y over the pixels with weight, orthonormal to each other and orthogonal to 1.
    fn find_slopes(&mut self) {
        let (stride, radius) = (self.stride, self.radius as f32);
        let count = self.weights.len();
        self.slopes.iter_mut().for_each(|slope| slope.resize(count, 0.0));
        let [along, down] = &mut self.slopes;
        for (i, &weight) in self.weights.iter().enumerate() {
            along[i] = weight * ((i % stride) as f32 - radius);
            down[i] = weight * ((i / stride) as f32 - radius);
        }
        for slope in [&mut *along, &mut *down] {
            let mean = sum_of(vectors(slope).sum()) / self.pixels.max(1.0);
            subtract(slope, &self.weights, mean);
        }
        normalize(along);
        let shared = inner_product(along, down);
        subtract(down, along, shared);
        normalize(down);
    }

    fn take_out_slopes(&mut self) {
        for gradient in [&mut self.gradient_u, &mut self.gradient_v] {
            let mean = sum_of(vectors(gradient).sum()) / self.pixels.max(1.0);
            subtract(gradient, &self.weights, mean);
        }
        for slope in &self.slopes {
            for plane in [&mut self.values, &mut self.gradient_u, &mut self.gradient_v] {
                let share = inner_product(slope, plane);
                subtract(plane, slope, share);
            }
        }
    }

    /// Gradient-weighted difference between the window at `point` and the template. `sums` of the previous
    /// iteration are reused when the window lies between the same pixels.
    fn mismatch(
        &mut self,
        image: &GrayImage,
        point: [f32; 2],
        lighting: Lighting,
        sums: &mut Option<ImageSums>,
    ) -> Option<[f32; 2]> {
        let corner = point.map(|c| c - self.radius as f32);
        let floor = corner.map(f32::floor);
        let place = floor.map(|c| c as isize);
        let seen = match sums {
            Some(sums) if sums.place == place => sums,
            _ => sums.insert(self.sum_image(image, place, lighting)),
        };
        let fraction = [corner[0] - floor[0], corner[1] - floor[1]];
        let seen_product = seen.gradients.at(fraction);
        let Some(values) = seen.values.map(|values| values.at(fraction)) else {
            let own_product = self.gradient_sums.value;
            return Some([seen_product[0] - own_product[0], seen_product[1] - own_product[1]]);
        };
        let [product, total] = values;
        let s = self.value_sums();
        let (gain, mean) = (product / s.energy, total / self.pixels);
        // A negative of the template is not a match.
        if gain < 0.1 {
            return None;
        }
        let difference = |axis: usize| {
            (seen_product[axis] - gain * s.gradient_value[axis] - mean * s.gradient[axis]) / gain
        };
        Some([difference(0), difference(1)])
    }

    /// Sums of the template with the image's window whose upper left corner is the pixel `place`.
    fn sum_image(&mut self, image: &GrayImage, place: [isize; 2], lighting: Lighting) -> ImageSums {
        let stride = self.stride;
        if lighting == Lighting::Affine {
            self.value_sums();
        }
        let region = region(image, place, [stride, 2 * self.radius + 1], &mut self.patch);
        let gradients = ShiftedSums::of([&self.gradient_u, &self.gradient_v], stride, region);
        // With constant brightness, only the gradients' sums are needed.
        let values = match lighting {
            Lighting::Constant => None,
            Lighting::Affine => Some(ShiftedSums::of([&self.values, &self.weights], stride, region)),
        };
        ImageSums { place, gradients, values }
    }

    fn judge(&mut self, image: &GrayImage, point: [f32; 2], lighting: Lighting) -> Alignment {
        let s = self.value_sums();
        let seen = self.compare(image, point);
        let pixels = self.pixels;
        let seen_mean = seen.total / pixels;
        let seen_energy = (seen.squares - seen.total * seen_mean - seen.sloped).max(0.0);
        let correlation = seen.product / (s.energy * seen_energy).sqrt().max(f32::MIN_POSITIVE);
        let squared = match lighting {
            Lighting::Constant => {
                let offset = seen_mean - s.mean;
                seen_energy - 2.0 * seen.product + s.energy + pixels * offset * offset
            }
            // The difference that a factor and an offset cannot explain, in the template's own contrast.
            Lighting::Affine => s.energy * (1.0 - correlation * correlation),
        };
        Alignment { point, residual: (squared.max(0.0) / pixels).sqrt(), correlation }
    }

    /// Sums over the window at `point`, and of its products with the template.
    fn compare(&mut self, image: &GrayImage, point: [f32; 2]) -> WindowSums {
        let stride = self.stride;
        let corner = point.map(|c| c - self.radius as f32);
        let [mut totals, mut squares, mut products] = [f32x4::ZERO; 3];
        let mut slopes = [f32x4::ZERO; 2];
        let (values, weights, [along, down]) = (&self.values, &self.weights, &self.slopes);
        let rows = 2 * self.radius + 1;
        let window = Interpolated::new(image, corner, [stride, rows], &mut self.patch);
        let mut buffer = [0.0_f32; MOST_COLUMNS];
        let seen = buffer.get_mut(..stride).unwrap_or(&mut []);
        for row in 0..rows {
            window.read(row, seen);
            let [values, weights, along, down] = [values, weights, along, down]
                .map(|plane| plane.get(row * stride..(row + 1) * stride).unwrap_or(&[]));
            if self.is_level {
                for ((seen, along), down) in vectors(seen).zip(vectors(along)).zip(vectors(down)) {
                    slopes[0] += seen * along;
                    slopes[1] += seen * down;
                }
            }
            for ((seen, value), weight) in vectors(seen).zip(vectors(values)).zip(vectors(weights)) {
                let seen = seen * weight;
                totals += seen;
                squares += seen * seen;
                products += seen * value;
            }
        }
        let [total, squares, product] = [totals, squares, products].map(sum_of);
        let sloped = slopes.map(|slope| sum_of(slope).powi(2)).iter().sum();
        WindowSums { total, squares, product, sloped }
    }
}

/// a -= factor b.
fn subtract(a: &mut [f32], b: &[f32], factor: f32) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a -= factor * b);
}

fn inner_product(a: &[f32], b: &[f32]) -> f32 {
    sum_of(vectors(a).zip(vectors(b)).map(|(a, b)| a * b).sum())
}

/// Scales to length 1, unless the length is about 0.
fn normalize(a: &mut [f32]) {
    let norm = inner_product(a, a).sqrt();
    let factor = if norm > 1e-6 { 1.0 / norm } else { 0.0 };
    for value in a {
        *value *= factor;
    }
}

impl ValueSums {
    /// The sums of planes that are 0 in their padding; the mean of `values` is already subtracted.
    fn of(mean: f32, values: &[f32], [gradient_u, gradient_v]: [&[f32]; 2]) -> Self {
        let mut sums = [f32x4::ZERO; 5];
        for ((value, gu), gv) in vectors(values).zip(vectors(gradient_u)).zip(vectors(gradient_v)) {
            sums[0] += value * value;
            sums[1] += gu;
            sums[2] += gv;
            sums[3] += gu * value;
            sums[4] += gv * value;
        }
        let [energy, u, v, u_value, v_value] = sums.map(sum_of);
        Self { mean, energy, gradient: [u, v], gradient_value: [u_value, v_value] }
    }
}

/// Sums of the template with the other image, valid while the window's corner lies between the same pixels.
#[derive(Debug, Clone, Copy)]
struct ImageSums {
    /// The pixel at the window's upper left corner.
    place: [isize; 2],
    /// Sums with the gradients.
    gradients: ShiftedSums,
    /// Sums with the values minus their mean, and with the weights; only when brightness may change.
    values: Option<ShiftedSums>,
}

/// Sums over a window of the other image.
#[derive(Debug, Clone, Copy)]
struct WindowSums {
    total: f32,
    squares: f32,
    /// Sum of products with the template's values minus their mean.
    product: f32,
    /// The part of the squares that brightness slopes explain.
    sloped: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(du: f32, dv: f32, gain: f32, offset: f32) -> GrayImage {
        let value = |i: usize| {
            let (u, v) = ((i % 64) as f32 - du, (i / 64) as f32 - dv);
            0.5 + 0.2 * (0.37 * u + 0.11 * v).sin() + 0.2 * (0.29 * v - 0.07 * u).cos()
        };
        GrayImage::new(64, 64, (0..64 * 64).map(|i| gain * value(i) + offset).collect()).unwrap()
    }

    fn limits(lighting: Lighting) -> AlignmentLimits {
        AlignmentLimits { iterations: 30, epsilon: 1e-3, lighting }
    }

    #[test]
    fn finds_a_shift_to_a_fraction_of_a_pixel() {
        let mut template = Template::default();
        template.take(&waves(0.0, 0.0, 1.0, 0.0), [31.3, 30.6], 7);
        let moved = waves(1.7, -0.9, 1.0, 0.0);
        let found = template.align(&moved, [31.3, 30.6], limits(Lighting::Constant)).unwrap();
        assert!((found.point[0] - 33.0).abs() < 0.02 && (found.point[1] - 29.7).abs() < 0.02, "{found:?}");
        assert!(found.residual < 3e-3);
    }

    #[test]
    fn affine_light_needs_the_affine_model() {
        let mut template = Template::default();
        template.take(&waves(0.0, 0.0, 1.0, 0.0), [31.3, 30.6], 7);
        let darker = waves(1.7, -0.9, 0.6, 0.1);
        let found = template.align(&darker, [31.3, 30.6], limits(Lighting::Affine)).unwrap();
        assert!((found.point[0] - 33.0).abs() < 0.02 && (found.point[1] - 29.7).abs() < 0.02, "{found:?}");
        assert!(found.residual < 3e-3);
        let wrong = template.align(&darker, [31.3, 30.6], limits(Lighting::Constant));
        assert!(wrong.is_none_or(|found| (found.point[0] - 33.0).abs() > 0.1 || found.residual > 0.02));
    }

    #[test]
    fn a_warped_window_is_found_turned() {
        let angle = 0.5_f32;
        let (sin, cos) = angle.sin_cos();
        let source = waves(0.0, 0.0, 1.0, 0.0);
        // The image turned around (32, 32): its pixel p shows 32 + R (p - 32) of the source.
        let turned = GrayImage::new(
            64,
            64,
            (0..64 * 64)
                .map(|i| {
                    let (x, y) = ((i % 64) as f32 - 32.0, (i / 64) as f32 - 32.0);
                    bilinear(&source, [32.0 + cos * x - sin * y, 32.0 + sin * x + cos * y])
                })
                .collect(),
        )
        .unwrap();
        let mut template = Template::default();
        template.take_warped(&source, None, [32.0, 32.0], [[cos, -sin], [sin, cos]], 7);
        let found = template.align(&turned, [33.1, 31.2], limits(Lighting::Constant)).unwrap();
        assert!((found.point[0] - 32.0).abs() < 0.03 && (found.point[1] - 32.0).abs() < 0.03, "{found:?}");
    }

    #[test]
    fn a_slope_of_light_and_what_is_masked_do_not_count() {
        let source = waves(0.0, 0.0, 1.0, 0.0);
        // Other brightness, and another background from column 35 on.
        let changed = waves(0.8, -0.6, 0.7, 0.1);
        let data = changed.data().iter().enumerate().map(|(i, value)| match i % 64 {
            35.. => 0.3 + 0.4 * ((i * i) % 7) as f32 / 7.0,
            column => value + 0.02 * column as f32 - 0.01 * (i / 64) as f32,
        });
        let changed = GrayImage::new(64, 64, data.collect()).unwrap();
        let mask = |i: usize| if i % 64 < 34 { 1.0 } else { 0.0 };
        let mask = GrayImage::new(64, 64, (0..64 * 64).map(mask).collect()).unwrap();
        let mut template = Template::default();
        let straight = [[1.0, 0.0], [0.0, 1.0]];
        template.take_warped(&source, Some(&mask), [31.0, 31.0], straight, 7);
        assert!((template.share() - 10.0 / 15.0).abs() < 1e-6, "{}", template.share());
        let found = template.align(&changed, [31.0, 31.0], limits(Lighting::Affine)).unwrap();
        assert!((found.point[0] - 31.8).abs() < 0.05 && (found.point[1] - 30.4).abs() < 0.05, "{found:?}");
        assert!(found.correlation > 0.995, "{found:?}");
        // The next window has all its pixels again.
        template.take(&source, [31.0, 31.0], 7);
        assert_eq!(template.share(), 1.0);
        let found = template.align(&waves(0.8, -0.6, 1.0, 0.0), [31.0, 31.0], limits(Lighting::Constant));
        assert!(found.is_some_and(|found| found.residual < 3e-3));
    }

    #[test]
    fn flat_windows_and_far_starts_are_refused() {
        let flat = GrayImage::new(30, 30, vec![0.3; 900]).unwrap();
        let mut template = Template::default();
        template.take(&flat, [15.0, 15.0], 5);
        assert_eq!(template.min_eigenvalue(), 0.0);
        assert!(template.align(&flat, [15.0, 15.0], limits(Lighting::Constant)).is_none());
        template.take(&waves(0.0, 0.0, 1.0, 0.0), [15.0, 15.0], 5);
        for start in [[-2.0, 5.0], [5.0, 1e9], [f32::NAN, 5.0], [f32::INFINITY, 0.0]] {
            assert!(template.align(&waves(0.0, 0.0, 1.0, 0.0), start, limits(Lighting::Affine)).is_none());
        }
    }
}

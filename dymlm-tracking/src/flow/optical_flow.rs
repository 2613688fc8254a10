use super::config::FlowConfig;
use super::image_pyramid::ImagePyramid;
use super::sampling::is_within;
use super::template::{AlignmentLimits, Template};
use crate::{Error, GrayImage};

/// A window's alignment ends after this many steps, or with a step below this many pixels (`OpenCV`'s
/// defaults).
const ITERATIONS: usize = 30;
const EPSILON: f32 = 0.01;
/// Least eigenvalue of the mean gradient matrix, in squared grey levels (of 0..=1) per squared pixel.
const LEAST_TEXTURE: f32 = 1e-6;
/// Largest root mean square difference of two windows that show the same, in grey levels of 0..=1.
const MOST_RESIDUAL: f32 = 0.15;

/// Tracks points from one image to the next by pyramidal Lucas-Kanade.
///
/// Bouguet: "Pyramidal Implementation of the Lucas Kanade Feature Tracker", Intel 2000. A point's window is
/// aligned on the coarsest level first, and each result is the start on the next finer level. Tracking back
/// must end near the point's start (Kalal 2010). O(points x levels x iterations x pixels of the window);
/// [`Self::track_into`] does not allocate once its buffers have grown.
///
/// ```
/// use dymlm_tracking::{FlowConfig, FlowStatus, GrayImage, ImagePyramid, OpticalFlow};
///
/// let view = |shift: f32| {
///     let value = |i: usize| {
///         let (u, v) = ((i % 160) as f32 - shift, (i / 160) as f32);
///         0.5 + 0.2 * (0.3 * u + 0.1 * v).sin() + 0.2 * (0.23 * v).cos()
///     };
///     GrayImage::new(160, 120, (0..160 * 120).map(value).collect())
/// };
/// let mut flow = OpticalFlow::new(&FlowConfig::default())?;
/// let [before, after] = [ImagePyramid::new(&view(0.0)?, 3), ImagePyramid::new(&view(6.4)?, 3)];
/// let found = flow.track(&before, &after, &[[80.0, 60.0]]);
/// assert_eq!(found[0].status, FlowStatus::Tracked);
/// assert!((found[0].point[0] - 86.4).abs() < 0.05 && (found[0].point[1] - 60.0).abs() < 0.05);
/// # Ok::<(), dymlm_tracking::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct OpticalFlow {
    config: FlowConfig,
    template: Template,
}

/// The result of tracking a point.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FlowPoint {
    /// The point in the other image, pixels; the best guess when it is not tracked.
    pub point: [f32; 2],
    /// Whether the result is reliable, or why not.
    pub status: FlowStatus,
    /// Root mean square difference of the two windows, in grey levels of 0..=1; infinite when they were not
    /// compared.
    pub residual: f32,
    /// Distance from its start at which the point tracked back ended, pixels; 0 when it was not tracked back.
    pub forward_backward: f32,
}

/// How the tracking of a point ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum FlowStatus {
    /// The point was found.
    Tracked,
    /// The point began or ended outside the image, or is not finite.
    OutOfImage,
    /// The point's window has too little texture.
    NoTexture,
    /// The window that was found differs too much from the window in the first image.
    Dissimilar,
    /// Tracking back ended too far from the start.
    Inconsistent,
}

impl OpticalFlow {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: &FlowConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self { config: config.clone(), template: Template::default() })
    }

    /// The settings.
    pub fn config(&self) -> &FlowConfig {
        &self.config
    }

    /// Tracks each of `points` from one image to the next; results are in the same order. Only levels that
    /// both pyramids have are used.
    pub fn track(&mut self, from: &ImagePyramid, to: &ImagePyramid, points: &[[f32; 2]]) -> Vec<FlowPoint> {
        let mut found = Vec::with_capacity(points.len());
        self.track_into(from, to, points, points, &mut found);
        found
    }

    /// As [`Self::track`], into the caller's buffer, with a guess from which to begin each point's search
    /// (its own place when there is no guess).
    pub fn track_into(
        &mut self,
        from: &ImagePyramid,
        to: &ImagePyramid,
        points: &[[f32; 2]],
        guesses: &[[f32; 2]],
        found: &mut Vec<FlowPoint>,
    ) {
        found.clear();
        for (i, &point) in points.iter().enumerate() {
            let guess = guesses.get(i).copied().unwrap_or(point);
            found.push(self.track_point(from.levels(), to.levels(), point, guess));
        }
    }

    fn track_point(
        &mut self,
        from: &[GrayImage],
        to: &[GrayImage],
        point: [f32; 2],
        guess: [f32; 2],
    ) -> FlowPoint {
        let mut forth = self.follow(from, to, point, guess);
        if forth.status != FlowStatus::Tracked {
            return forth;
        }
        if forth.residual > MOST_RESIDUAL {
            forth.status = FlowStatus::Dissimilar;
            return forth;
        }
        if let Some(most) = self.config.max_forward_backward {
            // Tracking back begins at the point's known start, and may only leave it if another place fits
            // better.
            let back = self.follow(to, from, forth.point, point);
            forth.forward_backward = distance(back.point, point);
            if back.status != FlowStatus::Tracked || forth.forward_backward > most {
                forth.status = FlowStatus::Inconsistent;
            }
        }
        forth
    }

    /// Aligns the point's window from the coarsest level down to the image itself.
    fn follow(
        &mut self,
        from: &[GrayImage],
        to: &[GrayImage],
        point: [f32; 2],
        guess: [f32; 2],
    ) -> FlowPoint {
        let failed =
            |point, status| FlowPoint { point, status, residual: f32::INFINITY, forward_backward: 0.0 };
        if !from.first().is_some_and(|image| is_within(image, point)) {
            return failed(guess, FlowStatus::OutOfImage);
        }
        let limits =
            AlignmentLimits { iterations: ITERATIONS, epsilon: EPSILON, lighting: self.config.lighting };
        let mut result = failed(guess, FlowStatus::OutOfImage);
        let levels = from.iter().zip(to).enumerate().take(self.config.halvings + 1).rev();
        for (level, (source, target)) in levels {
            let scale = 1.0 / (1_u32 << level.min(31)) as f32;
            // A coarse level only prepares the next one: it may fail where a finer level succeeds.
            let is_last = level == 0;
            self.template.take(source, point.map(|c| c * scale), self.config.window_radius);
            if self.template.min_eigenvalue() < LEAST_TEXTURE {
                if is_last {
                    return failed(result.point, FlowStatus::NoTexture);
                }
                continue;
            }
            let start = result.point.map(|c| c * scale);
            if is_last {
                let Some(found) = self.template.align(target, start, limits) else {
                    return failed(result.point, FlowStatus::OutOfImage);
                };
                (result.point, result.residual) = (found.point, found.residual);
                result.status = FlowStatus::Tracked;
            } else if let Some(point) = self.template.search(target, start, limits) {
                result.point = point.map(|c| c / scale);
            }
        }
        result
    }
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    let [du, dv] = [a[0] - b[0], a[1] - b[1]];
    (du * du + dv * dv).sqrt()
}

use dymlm_core::{Plane, Rgb};
use dymlm_geometry::SampleGrid as Window;

use crate::{ObjectView, SupportPlane};

/// Finds things that lie so flat on a plane that depth cannot separate them from it: magazines, sheets, a
/// phone.
///
/// The colours of the plane around the box tell which samples in the box are the plane: a sample is the
/// thing's when its colour is more frequent in the box than around it (the ratio of both histograms, Swain
/// and Ballard 1991). Without colours the whole box is taken as the thing, and the views of several frames
/// cut it out. O(samples).
#[derive(Debug, Clone)]
pub(super) struct FlatThing {
    inside: Vec<f32>,
    outside: Vec<f32>,
    smooth: Vec<f32>,
    is_other: Vec<bool>,
}

/// Levels of a colour channel in the histograms.
const LEVELS: usize = 8;
/// Least share of the box's samples that must lie on the plane.
const LYING: f32 = 0.6;
/// Least samples on the plane around the box from which the plane's colours are learnt.
const LEAST_OUTSIDE: f32 = 20.0;
/// Least ratio of a colour's frequency in the box to its frequency around the box.
const RATIO: f32 = 2.0;

impl Default for FlatThing {
    fn default() -> Self {
        let bins = LEVELS * LEVELS * LEVELS;
        Self {
            inside: vec![0.0; bins],
            outside: vec![0.0; bins],
            smooth: vec![0.0; bins],
            is_other: Vec::new(),
        }
    }
}

impl FlatThing {
    /// Marks the samples that cannot belong to a thing lying on a plane (camera frame): those of the plane
    /// itself, and those more than `height` metres above or below it. Returns false, with nothing marked,
    /// when too little of the box lies on the plane.
    pub(super) fn mark(
        &mut self,
        view: &ObjectView<'_>,
        window: &Window,
        plane: &Plane,
        is_ground: &[bool],
        height: f64,
    ) -> bool {
        self.is_other.clear();
        let rises = |index: usize| {
            let place = window.samples[index].point.map(f64::from);
            let above = plane.signed_distance(place);
            above > height || above < -height
        };
        let is_low = |index: usize| is_ground.get(index).copied().unwrap_or(false) && !rises(index);
        self.count(view, window, is_low);
        let in_box = window.samples.iter().filter(|sample| sample.is_in_box).count() as f32;
        let lying: f32 = self.inside.iter().sum();
        if in_box == 0.0 || lying < LYING * in_box {
            return false;
        }
        let around: f32 = self.outside.iter().sum();
        let has_colors = view.frame.color().is_some() && around >= LEAST_OUTSIDE;
        self.spread();
        for index in 0..window.samples.len() {
            let sample = &window.samples[index];
            let is_plane = || {
                if !has_colors {
                    return !sample.is_in_box;
                }
                let bin = color_of(view, window.pixel(sample.column as usize, sample.row as usize));
                self.inside[bin] / lying < RATIO * self.smooth[bin] / around
            };
            let is_other = rises(index) || (is_low(index) && is_plane());
            self.is_other.push(is_other);
        }
        true
    }

    /// For each sample of the last window, whether it is marked as not of the thing.
    pub(super) fn is_other(&self) -> &[bool] {
        &self.is_other
    }

    /// Counts the colours of the samples on the plane, in the box and well outside it.
    fn count(&mut self, view: &ObjectView<'_>, window: &Window, is_low: impl Fn(usize) -> bool) {
        self.inside.fill(0.0);
        self.outside.fill(0.0);
        let low = window.samples.iter().enumerate().filter(|&(index, _)| is_low(index));
        for (_, sample) in low {
            let bin = color_of(view, window.pixel(sample.column as usize, sample.row as usize));
            if sample.is_in_box {
                self.inside[bin] += 1.0;
            } else if !sample.is_beside_box {
                self.outside[bin] += 1.0;
            }
        }
    }

    /// Smooths the histogram of the surroundings: each colour also counts in neighbouring bins, because the
    /// light varies over a table.
    fn spread(&mut self) {
        self.smooth.copy_from_slice(&self.outside);
        for stride in [1, LEVELS, LEVELS * LEVELS] {
            let level = |bin: usize| bin / stride % LEVELS;
            for bin in 0..self.smooth.len() {
                let below = if level(bin) > 0 { self.outside[bin - stride] } else { 0.0 };
                let above = if level(bin) + 1 < LEVELS { self.outside[bin + stride] } else { 0.0 };
                self.smooth[bin] = self.smooth[bin].max(0.5 * below).max(0.5 * above);
            }
        }
    }
}

/// The bin of a pixel's colour.
fn color_of(view: &ObjectView<'_>, [u, v]: [usize; 2]) -> usize {
    let color: Rgb = view.frame.color().and_then(|image| image.at(u, v)).unwrap_or_default();
    color.iter().fold(0, |bin, &channel| bin * LEVELS + usize::from(channel) * LEVELS / 256)
}

/// The plane on which a thing lies.
#[derive(Debug, Clone, Copy)]
pub(super) struct LyingPlane {
    pub(super) support: SupportPlane,
    /// The plane in the camera frame.
    pub(super) plane: Plane,
}

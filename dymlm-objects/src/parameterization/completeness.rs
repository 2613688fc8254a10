use dymlm_core::{PinholeCamera, SensorModel, Visibility};
use dymlm_geometry::{GridSample as Sample, SampleGrid as Window};

use super::object_cluster::ObjectCluster;
use crate::ObjectView;
use crate::view::PLACE_SIGMA;

/// What cuts off the view of an object on one side of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum SideView {
    /// Nothing: the object is seen to its end.
    #[default]
    Whole,
    /// The border of the image.
    ImageBorder,
    /// A mover before it.
    Mover,
    /// Another, nearer thing before it.
    Occluder,
}

/// How much of an object a detection shows, for each side of its box.
///
/// A partial view does not shrink the object in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Completeness {
    /// The left side.
    pub left: SideView,
    /// The upper side.
    pub top: SideView,
    /// The right side.
    pub right: SideView,
    /// The lower side.
    pub bottom: SideView,
}

impl Completeness {
    /// Whether something cuts the view off on any side.
    pub fn is_partial(&self) -> bool {
        self.sides().iter().any(|&side| side != SideView::Whole)
    }

    /// The view on the side to which a direction (camera's frame) points; `None` when it points mostly along
    /// the view.
    pub(crate) fn toward(self, [x, y, z]: [f64; 3], camera: &PinholeCamera) -> Option<SideView> {
        let (x, y) = (x * camera.fx().signum(), y * camera.fy().signum());
        if z.abs() > ALONG_VIEW {
            None
        } else if x.abs() >= y.abs() {
            Some(if x < 0.0 { self.left } else { self.right })
        } else {
            Some(if y < 0.0 { self.top } else { self.bottom })
        }
    }

    /// Left, top, right, bottom.
    pub fn sides(&self) -> [SideView; 4] {
        [self.left, self.top, self.right, self.bottom]
    }
}

/// Cosine of a unit vector with the optical axis above which it points to no side of the image.
pub(crate) const ALONG_VIEW: f64 = 0.8;

/// What is needed to judge the sides of a window.
pub(super) struct Surroundings<'a> {
    pub(super) view: &'a ObjectView<'a>,
    pub(super) window: &'a Window,
    pub(super) cluster: &'a ObjectCluster,
    pub(super) sensor: &'a SensorModel,
}

/// Share of an object's extent, from a side, whose samples are checked; and share of the checked samples that
/// something else must cut off for the view to be partial. A lower value calls a view partial for a few
/// samples, a higher one overlooks what stands before a corner.
const RIM: f32 = 0.25;
/// Farthest place that is checked, in samples beyond the object's last one.
const FARTHEST: i64 = 4;
impl Surroundings<'_> {
    /// How much of the object is seen. An object without samples counts as seen completely.
    pub(super) fn completeness(&self) -> Completeness {
        if self.cluster.members.is_empty() {
            return Completeness::default();
        }
        let mut bounds = [[i64::MAX; 2], [i64::MIN; 2]];
        for sample in self.members() {
            for (axis, cell) in [sample.column, sample.row].into_iter().enumerate() {
                bounds[0][axis] = bounds[0][axis].min(cell.into());
                bounds[1][axis] = bounds[1][axis].max(cell.into());
            }
        }
        let side = |axis: usize, step: i64| self.side(&bounds, axis, step);
        Completeness { left: side(0, -1), top: side(1, -1), right: side(0, 1), bottom: side(1, 1) }
    }

    fn members(&self) -> impl Iterator<Item = &Sample> {
        self.cluster.members.iter().filter_map(|&index| self.window.samples.get(index as usize))
    }

    /// What cuts the view off at one side: `axis` is 0 for columns and 1 for rows, `step` leads to the side.
    fn side(&self, bounds: &[[i64; 2]; 2], axis: usize, step: i64) -> SideView {
        let extent = (bounds[1][axis] - bounds[0][axis]) as f32;
        let end = if step < 0 { bounds[0][axis] } else { bounds[1][axis] };
        let direction = if axis == 0 { [step, 0] } else { [0, step] };
        let mut asked = 0.0_f32;
        let mut counts = [0.0_f32; 3];
        for sample in self.members() {
            let cell = [i64::from(sample.column), i64::from(sample.row)];
            let in_rim = (cell[axis] - end).abs() as f32 <= RIM * extent;
            let next = self.window.sample_at(cell[0] + direction[0], cell[1] + direction[1]);
            if in_rim && !self.cluster.holds(next) {
                asked += 1.0;
                match self.beyond(sample, direction) {
                    SideView::Whole => {}
                    SideView::ImageBorder => counts[0] += 1.0,
                    SideView::Mover => counts[1] += 1.0,
                    SideView::Occluder => counts[2] += 1.0,
                }
            }
        }
        let causes = [SideView::ImageBorder, SideView::Mover, SideView::Occluder];
        if counts.iter().sum::<f32>() < RIM * asked.max(1.0) {
            return SideView::Whole;
        }
        let most =
            causes.into_iter().zip(counts).reduce(|most, next| if next.1 > most.1 { next } else { most });
        most.map_or(SideView::Whole, |(cause, _)| cause)
    }

    /// What the first pixel with information beyond a sample shows.
    fn beyond(&self, sample: &Sample, direction: [i64; 2]) -> SideView {
        let camera = self.view.frame.camera();
        let (width, height) = (camera.width() as i64, camera.height() as i64);
        let [u, v] = self.window.pixel(sample.column as usize, sample.row as usize).map(|c| c as i64);
        let stride = self.window.stride.max(2) as i64;
        let z = sample.point[2];
        for steps in 1..=FARTHEST {
            let (u, v) = (u + direction[0] * steps * stride, v + direction[1] * steps * stride);
            if !(0..width).contains(&u) || !(0..height).contains(&v) {
                return SideView::ImageBorder;
            }
            let pixel = (v * width + u) as usize;
            if !self.view.is_static(u as usize, v as usize) {
                return SideView::Mover;
            }
            let other = self.view.frame.depth().data()[pixel];
            if other > 0.0 {
                let tolerance = self.sensor.tolerance(z, PLACE_SIGMA);
                let seen = Visibility::of_reading(other.into(), z.into(), tolerance);
                let is_occluded = seen == Visibility::Occluded;
                return if is_occluded { SideView::Occluder } else { SideView::Whole };
            }
        }
        SideView::Whole
    }
}

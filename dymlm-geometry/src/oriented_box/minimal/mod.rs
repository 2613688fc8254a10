//! The axes of the box of least volume: [`MinimalAxes`].

mod descent;
mod extents;
mod hull;
mod rotation;
mod starts;

use descent::{Descent, descend};
use extents::Extents;
use hull::{HullScratch, Whitening};
use starts::START_ROTATIONS;

use dymlm_core::Point;
use dymlm_core::vector3::{Vector3, combined, cross, with_positive_greatest};

use crate::principal_axes::PrincipalAxes;

/// How many of the starts with the least volumes are followed some way down, and how many to the end.
const FOLLOWED: usize = 150;
const FINISHED: usize = 30;

/// Finds the axes of the box of least volume around points; keeps its working memory.
#[derive(Debug, Clone, Default)]
pub(super) struct MinimalAxes {
    hull: HullScratch,
    starts: Vec<Descent>,
}

impl MinimalAxes {
    /// The right-handed axes of the box, its longest side first; `None` when the points are in one plane, to
    /// rounding.
    pub(super) fn find(&mut self, points: &[Point], principal: &PrincipalAxes) -> Option<[Vector3; 3]> {
        let whitening = Whitening::of(principal)?;
        let hull = self.hull.build(points, &whitening)?;

        self.starts.clear();
        let mut extents = Extents::default();
        for axes in START_ROTATIONS.axes() {
            extents = Extents::of(hull, &axes, extents.touching());
            self.starts.push(Descent::new(axes, extents));
        }
        keep_least(&mut self.starts, FOLLOWED);
        for start in &mut self.starts {
            descend(hull, start, descent::COARSE);
        }
        keep_least(&mut self.starts, FINISHED);
        for start in &mut self.starts {
            descend(hull, start, descent::FINE);
        }
        keep_least(&mut self.starts, 1);
        let least = self.starts.first()?;
        Some(ordered(least, principal.axes))
    }
}

/// Keeps the `count` descents with the least volumes; of equal ones, the first.
fn keep_least(descents: &mut Vec<Descent>, count: usize) {
    descents.sort_by(|a, b| a.volume().total_cmp(&b.volume()));
    descents.truncate(count);
}

/// The axes in the world, the longest side first.
fn ordered(least: &Descent, principal: [Vector3; 3]) -> [Vector3; 3] {
    let lengths = least.extents().lengths();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| lengths[b].total_cmp(&lengths[a]));
    let axis = |of: usize| {
        let [x, y, z] = least.axes()[order[of]];
        with_positive_greatest(combined(1.0, combined(x, principal[0], y, principal[1]), z, principal[2]))
    };
    let (first, second) = (axis(0), axis(1));
    [first, second, cross(first, second)]
}

use std::ops::Range;

use dymlm_core::Point;

use crate::box_tree::BoxTree;

/// Points that lie side by side in the grid.
///
/// Tests against a run take eight points at a time, without branches, which compiles to vector code. The last
/// eight may reach beyond the run: the surplus is read but not counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    x: &'a [[f32; LANES]],
    y: &'a [[f32; LANES]],
    z: &'a [[f32; LANES]],
    len: usize,
}

const LANES: usize = 8;

impl<'a> Run<'a> {
    /// How many values have to follow the last one of a run.
    pub(super) const PADDING: usize = LANES - 1;

    /// The slots of a run, from coordinates that go on for [`Self::PADDING`] values at least.
    #[inline]
    pub(super) fn new([x, y, z]: [&'a [f32]; 3], slots: Range<usize>) -> Self {
        let padded = slots.start..slots.start + slots.len().next_multiple_of(LANES);
        let eights = |values: &'a [f32]| values[padded.clone()].as_chunks().0;
        Self { x: eights(x), y: eights(y), z: eights(z), len: slots.len() }
    }

    /// Number of points within the distance, counted no further than the eight that reach `enough`.
    #[inline]
    pub(super) fn count_within(self, point: Point, squared_eps: f32, enough: u32) -> u32 {
        let mut count = 0;
        let mut left = self.len;
        for ((x, y), z) in self.x.iter().zip(self.y).zip(self.z) {
            count += count_within_first([x, y, z], left.min(LANES) as i32, point, squared_eps);
            if count >= enough {
                break;
            }
            left -= left.min(LANES);
        }
        count
    }

    /// Whether any point lies within the distance.
    #[inline]
    pub(super) fn any_within(self, point: Point, squared_eps: f32) -> bool {
        self.count_within(point, squared_eps, 1) > 0
    }

    /// Whether any point lies within the distance of any point of another run.
    ///
    /// Almost always one of the first points is near one of the other run. Where none is, and both runs are
    /// long, boxes of points are compared.
    pub(super) fn any_pair_within(self, other: Self, squared_eps: f32) -> bool {
        const FEW: usize = 8;
        const FIRST: usize = 32;
        /// Number of pairs that are compared in the time it takes to put one point into a box.
        const PAIRS: usize = 256;
        let (few, many) = if self.len() < other.len() { (self, other) } else { (other, self) };
        if few.len() <= FEW {
            return few.points().any(|point| many.any_within(point, squared_eps));
        }
        let bounds = many.bounds();
        let is_near = |point| {
            squared_distance_to_box(point, bounds) <= squared_eps && many.any_within(point, squared_eps)
        };
        if few.len().saturating_mul(many.len()) <= PAIRS.saturating_mul(few.len() + many.len()) {
            return few.points().any(is_near);
        }
        few.points().take(FIRST).any(is_near)
            || BoxTree::new(few.points()).has_pair_within(&BoxTree::new(many.points()), squared_eps)
    }

    #[inline]
    fn len(self) -> usize {
        self.len
    }

    #[inline]
    pub(super) fn points(self) -> impl Iterator<Item = Point> + 'a {
        let (x, y, z) = (self.x.as_flattened(), self.y.as_flattened(), self.z.as_flattened());
        x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]).take(self.len)
    }

    /// Least and greatest coordinates.
    fn bounds(self) -> [Point; 2] {
        let start = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        self.points().fold(start, |[min, max], point| {
            let least = |axis: usize| if point[axis] < min[axis] { point[axis] } else { min[axis] };
            let greatest = |axis: usize| if point[axis] > max[axis] { point[axis] } else { max[axis] };
            [std::array::from_fn(least), std::array::from_fn(greatest)]
        })
    }
}

/// Number of points within the distance among the first `len` of eight.
#[inline]
fn count_within_first(points: [&[f32; LANES]; 3], len: i32, point: Point, squared_eps: f32) -> u32 {
    let mut squared = [0.0; LANES];
    for (others, x) in points.into_iter().zip(point) {
        for lane in 0..LANES {
            let difference = x - others[lane];
            squared[lane] += difference * difference;
        }
    }
    let mut count = 0;
    for (lane, squared) in (0..).zip(squared) {
        count += u32::from(squared <= squared_eps) & u32::from(lane < len);
    }
    count
}

/// Never more than the squared distance to any point of the box, in f32 as well: rounding is monotone.
#[inline]
fn squared_distance_to_box(point: Point, [min, max]: [Point; 2]) -> f32 {
    let [dx, dy, dz]: Point =
        std::array::from_fn(|axis| (min[axis] - point[axis]).max(point[axis] - max[axis]).max(0.0));
    dx * dx + dy * dy + dz * dz
}

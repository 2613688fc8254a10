//! Tests of one point against a run of points, whose coordinates lie in one slice an axis: plain loops that compile to
//! vector code.

use dymlm_core::Point;

/// A run of points, one slice an axis, of equal lengths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    pub(super) x: &'a [f32],
    pub(super) y: &'a [f32],
    pub(super) z: &'a [f32],
}

impl Run<'_> {
    /// Number of points within the distance.
    #[inline]
    pub(super) fn count_within(&self, point: Point, squared_eps: f32) -> u32 {
        self.squared_distances(point).map(|squared| u32::from(squared <= squared_eps)).sum()
    }

    /// Whether any point lies within the distance.
    #[inline]
    pub(super) fn any_within(&self, point: Point, squared_eps: f32) -> bool {
        self.squared_distances(point).any(|squared| squared <= squared_eps)
    }

    #[inline]
    fn squared_distances(&self, [x, y, z]: Point) -> impl Iterator<Item = f32> + '_ {
        self.x.iter().zip(self.y).zip(self.z).map(move |((&other_x, &other_y), &other_z)| {
            let (dx, dy, dz) = (x - other_x, y - other_y, z - other_z);
            dx * dx + dy * dy + dz * dz
        })
    }

    /// Number of points.
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.x.len()
    }

    /// The point at an index.
    #[inline]
    pub(super) fn point(&self, index: usize) -> Point {
        [self.x[index], self.y[index], self.z[index]]
    }

    /// Least and greatest coordinates.
    pub(super) fn bounds(&self) -> [Point; 2] {
        let of = |values: &[f32]| {
            values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), &v| {
                (if v < min { v } else { min }, if v > max { v } else { max })
            })
        };
        let [x, y, z] = [of(self.x), of(self.y), of(self.z)];
        [[x.0, y.0, z.0], [x.1, y.1, z.1]]
    }
}

/// Whether any point of one run lies within the distance of any point of the other.
pub(super) fn any_pair_within(a: Run<'_>, b: Run<'_>, squared_eps: f32) -> bool {
    const SMALL: usize = 8;
    if a.len().min(b.len()) == 0 {
        return false;
    }
    if b.len() <= SMALL {
        return (0..a.len()).any(|index| b.any_within(a.point(index), squared_eps));
    }
    // Rounding is monotone, so a point of the box is never nearer, in f32, than the box itself.
    let [min, max] = b.bounds();
    (0..a.len()).any(|index| {
        let point = a.point(index);
        let [dx, dy, dz]: Point =
            std::array::from_fn(|axis| (min[axis] - point[axis]).max(point[axis] - max[axis]).max(0.0));
        dx * dx + dy * dy + dz * dz <= squared_eps && b.any_within(point, squared_eps)
    })
}

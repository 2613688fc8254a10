const COLUMNS: usize = 256;

/// Adding this to a number of 0 to 2^31 leaves its nearest integer in the lowest bits.
const ROUNDER: f64 = 4_503_599_627_370_496.0;

/// Rounding is far below this share of the extent, as long as the coordinates are at most
/// [`GREATEST_OFFSET`] times the extent.
const MARGIN: f64 = 1e-9;
const GREATEST_OFFSET: f64 = 1e5;
const SMALLEST_EXTENT: f64 = 1e-100;

/// What lies surely, by more than rounding, within a convex polygon: for each column of x a range of y.
#[derive(Debug, Clone)]
pub(super) struct InnerColumns {
    x_min: f64,
    per_x: f64,
    ranges: Box<[Range; COLUMNS]>,
}

#[derive(Debug, Clone, Copy)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };
}

impl Default for InnerColumns {
    fn default() -> Self {
        Self { x_min: 0.0, per_x: 0.0, ranges: Box::new([Range::EMPTY; COLUMNS]) }
    }
}

impl InnerColumns {
    /// Takes the columns from a hull, counter-clockwise from its leftmost point; false when the hull is too narrow
    /// for any.
    pub(super) fn fill(&mut self, hull: &[[f64; 2]]) -> bool {
        let Some(extent) = Extent::of(hull).filter(Extent::is_resolved) else {
            return false;
        };
        let [width, height] = extent.size();
        let column = width / (COLUMNS - 1) as f64;
        (self.x_min, self.per_x) = (extent.min[0], 1.0 / column);
        let lower = |corner: usize| hull.get(corner).copied();
        let upper = |corner: usize| hull.get(hull.len().checked_sub(corner)? % hull.len()).copied();
        // One for each side of a column.
        let (mut below, mut above) = ([Chain::new(lower); 2], [Chain::new(upper); 2]);
        for (index, range) in self.ranges.iter_mut().enumerate() {
            // A coordinate that is rounded into the next column is within the margin.
            let (middle, half) = (extent.min[0] + index as f64 * column, 0.5 * column + MARGIN * width);
            let sides = [middle - half, middle + half].map(|x| x.clamp(extent.min[0], extent.max[0]));
            let [left, right] =
                [0, 1].map(|side| [below[side].y_at(sides[side]), above[side].y_at(sides[side])]);
            // A convex function is greatest, a concave one least, at an end.
            range.low = left[0].max(right[0]) + MARGIN * height;
            range.high = left[1].min(right[1]) - MARGIN * height;
        }
        // Those at the ends reach out of the hull by half their width.
        let [first, .., last] = &mut *self.ranges;
        (*first, *last) = (Range::EMPTY, Range::EMPTY);
        true
    }

    /// Whether the point is surely inside; false for NaN.
    #[inline]
    pub(super) fn contain(&self, point: &[f64; 2]) -> bool {
        let [x, y] = *point;
        let column = ((x - self.x_min) * self.per_x + ROUNDER).to_bits().wrapping_sub(ROUNDER.to_bits());
        self.ranges.get(column as usize).is_some_and(|range| y > range.low && y < range.high)
    }
}

/// The bounds of a hull.
struct Extent {
    min: [f64; 2],
    max: [f64; 2],
}

impl Extent {
    fn of(hull: &[[f64; 2]]) -> Option<Self> {
        let first = *hull.first()?;
        Some(hull.iter().fold(Self { min: first, max: first }, |extent, point| Self {
            min: [extent.min[0].min(point[0]), extent.min[1].min(point[1])],
            max: [extent.max[0].max(point[0]), extent.max[1].max(point[1])],
        }))
    }

    fn size(&self) -> [f64; 2] {
        [self.max[0] - self.min[0], self.max[1] - self.min[1]]
    }

    /// Whether the coordinates have digits enough for the margins.
    fn is_resolved(&self) -> bool {
        self.size().into_iter().zip(self.min).zip(self.max).all(|((size, min), max)| {
            size > SMALLEST_EXTENT && min.abs().max(max.abs()) <= GREATEST_OFFSET * size
        })
    }
}

/// One of the two chains of a hull between its leftmost and its rightmost point, walked from left to right.
#[derive(Clone, Copy)]
struct Chain<Corner> {
    corner: Corner,
    position: usize,
}

impl<Corner: Fn(usize) -> Option<[f64; 2]>> Chain<Corner> {
    fn new(corner: Corner) -> Self {
        Self { corner, position: 0 }
    }

    /// The chain's y; x must not decrease from call to call, nor leave the hull.
    fn y_at(&mut self, x: f64) -> f64 {
        while (self.corner)(self.position + 1).is_some_and(|next| next[0] < x) {
            self.position += 1;
        }
        match ((self.corner)(self.position), (self.corner)(self.position + 1)) {
            (Some(before), Some(next)) if next[0] > before[0] => {
                before[1] + (x - before[0]) / (next[0] - before[0]) * (next[1] - before[1])
            }
            // On a vertical edge, which begins with its lower end.
            (Some(before), _) => before[1],
            _ => f64::NAN,
        }
    }
}

/// Greatest number of columns.
pub(super) const COLUMNS: usize = 128;

/// Adding this to a number between -2^51 and 2^51 leaves its nearest integer in the lowest bits.
const ROUNDER: u64 = 3 << 51;

/// Points nearer to the hull than these shares of its extent do not count as surely inside. All is computed
/// relative to a point of the hull, so rounding is some 1e-15 of the extent in x. In y it is that times the
/// slope, which is at most one over the distance from the left or right end, in these shares.
const MARGIN_Y: f64 = 1e-9;
const MARGIN_X: f64 = 1e-5;
const SMALLEST_EXTENT: f64 = 1e-100;
/// Up to this many times the extent, coordinates have digits enough to resolve the margins.
const GREATEST_OFFSET: f64 = 1e8;

/// The part of a convex polygon that is inside by more than rounding: in each column of x, what is between a
/// chord of the lower and a chord of the upper side.
#[derive(Debug, Clone)]
pub(super) struct InnerColumns {
    /// The middle of the first column, and the polygon's lowest y.
    origin: [f64; 2],
    per_x: f64,
    /// Columns in use; after them comes an empty one, for points beyond.
    count: usize,
    columns: Box<[Column; COLUMNS + 1]>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Column {
    low: Line,
    high: Line,
}

/// y = start + slope x, relative to the origin.
#[derive(Debug, Clone, Copy, Default)]
struct Line {
    start: f64,
    slope: f64,
}

impl Line {
    fn through(a: [f64; 2], b: [f64; 2]) -> Self {
        let slope = (b[1] - a[1]) / (b[0] - a[0]);
        Self { start: a[1] - slope * a[0], slope }
    }

    #[inline]
    fn y_at(&self, x: f64) -> f64 {
        self.start + self.slope * x
    }

    fn raised(self, by: f64) -> Self {
        Self { start: self.start + by, ..self }
    }
}

impl Default for InnerColumns {
    fn default() -> Self {
        Self { origin: [0.0; 2], per_x: 0.0, count: 0, columns: Box::new([Column::default(); COLUMNS + 1]) }
    }
}

impl InnerColumns {
    /// Fills `count` columns, at most [`COLUMNS`], from a hull given counter-clockwise from its leftmost
    /// point. The columns of a hull that is too narrow contain nothing.
    pub(super) fn fill(&mut self, hull: &[[f64; 2]], count: usize) {
        self.count = 0;
        self.columns[0] = Column::default();
        let Some(extent) = Extent::of(hull).filter(Extent::is_resolved) else { return };
        self.count = count.min(COLUMNS);
        self.columns[self.count] = Column::default();
        let [width, height] = extent.size();
        let column = (1.0 - 2.0 * MARGIN_X) * width / self.count as f64;
        let origin = [extent.min[0] + MARGIN_X * width + 0.5 * column, extent.min[1]];
        (self.origin, self.per_x) = (origin, 1.0 / column);
        let relative = |corner: &[f64; 2]| [corner[0] - origin[0], corner[1] - origin[1]];
        let lower = |corner: usize| hull.get(corner).map(relative);
        let upper = |corner: usize| hull.get(hull.len().checked_sub(corner)? % hull.len()).map(relative);
        let (mut below, mut above) = (Chain::new(lower), Chain::new(upper));
        let mut ends = |side: usize| {
            let x = (side as f64 - 0.5) * column;
            [[x, below.y_at(x)], [x, above.y_at(x)]]
        };
        let mut left = ends(0);
        for (index, own) in self.columns[..self.count].iter_mut().enumerate() {
            let right = ends(index + 1);
            // A chord of a convex polygon is within it.
            own.low = Line::through(left[0], right[0]).raised(MARGIN_Y * height);
            own.high = Line::through(left[1], right[1]).raised(-MARGIN_Y * height);
            left = right;
        }
    }

    /// Whether the point is surely inside; false for NaN.
    #[inline]
    #[allow(clippy::needless_bitwise_bool, reason = "without branches")]
    pub(super) fn contain(&self, point: &[f64; 2]) -> bool {
        let rounder = ROUNDER as f64;
        let [x, y] = [point[0] - self.origin[0], point[1] - self.origin[1]];
        let column = (x * self.per_x + rounder).to_bits().wrapping_sub(rounder.to_bits());
        let own = &self.columns[(column as usize).min(self.count)];
        (y > own.low.y_at(x)) & (y < own.high.y_at(x))
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

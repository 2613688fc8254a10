use super::usable::usable;

/// A few points near the hull of many: the lowest and the highest in each of a number of columns of x.
#[derive(Debug, Clone, Default)]
pub(super) struct Outline {
    /// The usable points.
    points: Vec<[f64; 2]>,
    /// Lowest and highest point of each column; at infinity where the column has none.
    columns: Vec<[[f64; 2]; 2]>,
}

impl Outline {
    /// Writes the outline of some points by a number of columns.
    pub(super) fn trace<'a>(
        &mut self,
        points: impl Iterator<Item = &'a [f64; 2]>,
        columns: usize,
        outline: &mut Vec<[f64; 2]>,
    ) {
        outline.clear();
        self.points.clear();
        self.points.extend(points.filter_map(usable));
        let [left, right] = self.ends();
        outline
            .extend([left, right].into_iter().filter_map(|x| self.points.iter().find(|point| point[0] == x)));
        self.columns.clear();
        self.columns.resize(columns, [[0.0, f64::INFINITY], [0.0, f64::NEG_INFINITY]]);
        let per_x = columns as f64 / (right - left);
        for point in &self.points {
            // When all points have the same x, this is 0 times infinity, NaN, which becomes column 0.
            let column = ((point[0] - left) * per_x) as usize;
            let [low, high] = &mut self.columns[column.min(columns - 1)];
            if point[1] < low[1] {
                *low = *point;
            }
            if point[1] > high[1] {
                *high = *point;
            }
        }
        outline.extend(self.columns.iter().flatten().filter(|point| point[1].is_finite()));
    }

    /// The least and the greatest x.
    fn ends(&self) -> [f64; 2] {
        self.points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[left, right], &[x, _]| {
            [if x < left { x } else { left }, if x > right { x } else { right }]
        })
    }
}

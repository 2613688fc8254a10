const COLUMNS: usize = 128;

/// Some points near the hull of many: in each of a number of columns of x the lowest and the highest.
#[derive(Debug, Clone, Default)]
pub(super) struct Outline {
    /// Lowest and highest point of each column that has any.
    columns: Vec<Option<[[f64; 2]; 2]>>,
}

impl Outline {
    /// Writes the outline of some finite points, which may be gone through more than once.
    pub(super) fn trace(
        &mut self,
        points: impl Iterator<Item = [f64; 2]> + Clone,
        outline: &mut Vec<[f64; 2]>,
    ) {
        outline.clear();
        let mut ends = points.clone();
        let Some(first) = ends.next() else {
            return;
        };
        let [left, right] = ends.fold([first; 2], |[left, right], point| {
            [if point[0] < left[0] { point } else { left }, if point[0] > right[0] { point } else { right }]
        });
        outline.extend([left, right]);
        self.columns.clear();
        self.columns.resize(COLUMNS, None);
        let per_x = COLUMNS as f64 / (right[0] - left[0]);
        for point in points {
            // Points that are all at one x make it 0 times infinity: column 0.
            let column = ((point[0] - left[0]) * per_x) as usize;
            let [low, high] = self.columns[column.min(COLUMNS - 1)].get_or_insert([point; 2]);
            if point[1] < low[1] {
                *low = point;
            }
            if point[1] > high[1] {
                *high = point;
            }
        }
        outline.extend(self.columns.iter().flatten().flatten());
    }
}

use super::inner_columns::InnerColumns;
use super::inner_ellipse::InnerEllipse;
use super::usable::usable;

/// Tells points that lie surely within a hull from those that may be outside: by an ellipse, which is quick,
/// then by columns, which are tight.
#[derive(Debug, Clone, Default)]
pub(super) struct InnerRegion {
    ellipse: Option<InnerEllipse>,
    columns: InnerColumns,
}

/// The ellipse is dropped when more than one in this many groups of four points is not inside it: branches
/// that a processor cannot predict cost more than the columns.
const MISSED_OF: usize = 4;

impl InnerRegion {
    /// Takes the region, with a number of columns, from a hull given counter-clockwise from its leftmost
    /// point.
    pub(super) fn fill(&mut self, hull: &[[f64; 2]], columns: usize) {
        self.ellipse = InnerEllipse::of(hull);
        self.columns.fill(hull, columns);
    }

    /// Adds those of a block's usable points that may be outside.
    pub(super) fn add_outer(&mut self, block: &[[f64; 2]], outer: &mut Vec<[f64; 2]>) {
        let (fours, rest) = block.as_chunks::<4>();
        outer.extend(rest.iter().filter_map(usable));
        let Some(ellipse) = self.ellipse else {
            return fours.iter().for_each(|four| self.add_outside_columns(four, outer));
        };
        let mut missed = 0;
        for four in fours.iter().filter(|four| !ellipse.contains(four)) {
            self.add_outside_columns(four, outer);
            missed += 1;
        }
        if MISSED_OF * missed > fours.len() {
            self.ellipse = None;
        }
    }

    #[inline]
    fn add_outside_columns(&self, four: &[[f64; 2]; 4], outer: &mut Vec<[f64; 2]>) {
        // Without a branch for each point.
        if !four.iter().fold(true, |all, point| all & self.columns.contain(point)) {
            let outside = four.iter().filter(|point| !self.columns.contain(point));
            outer.extend(outside.filter_map(usable));
        }
    }
}

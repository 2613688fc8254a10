use std::cmp::Ordering;

/// Sorts points by x, then y; keeps its working memory.
///
/// Points are dealt out to columns of equal width, as many as there are points, and each column is sorted:
/// O(n) when x spreads them, O(n log n) at worst.
#[derive(Debug, Clone, Default)]
pub(super) struct LeftToRight {
    /// Where each column ends.
    ends: Vec<usize>,
    dealt: Vec<[f64; 2]>,
}

/// Up to this many points are sorted without columns.
const FEW: usize = 64;

impl LeftToRight {
    /// Sorts finite points.
    pub(super) fn sort(&mut self, points: &mut Vec<[f64; 2]>) {
        let [left, right] = points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[left, right], point| {
            [left.min(point[0]), right.max(point[0])]
        });
        let per_x = points.len() as f64 / (right - left);
        if points.len() <= FEW || !per_x.is_finite() {
            return points.sort_unstable_by(order);
        }
        // Rounding keeps the order.
        self.deal(points, |point| ((point[0] - left) * per_x) as usize);
        std::mem::swap(points, &mut self.dealt);
        let mut start = 0;
        for &end in &self.ends {
            points[start..end].sort_unstable_by(order);
            start = end;
        }
    }

    /// Puts points into the order of their columns.
    fn deal(&mut self, points: &[[f64; 2]], column: impl Fn(&[f64; 2]) -> usize) {
        let Self { ends, dealt } = self;
        ends.clear();
        // The rightmost points have a column of their own.
        ends.resize(points.len() + 1, 0);
        for point in points {
            ends[column(point)] += 1;
        }
        let mut count = 0;
        for end in ends.iter_mut() {
            count += std::mem::replace(end, count);
        }
        dealt.clear();
        dealt.resize(points.len(), [0.0; 2]);
        for point in points {
            let place = &mut ends[column(point)];
            dealt[*place] = *point;
            *place += 1;
        }
    }
}

/// By x, then y. Sorting only uses whether one is less.
#[inline]
#[allow(clippy::needless_bitwise_bool, reason = "without branches")]
fn order(a: &[f64; 2], b: &[f64; 2]) -> Ordering {
    let is_less = |a: &[f64; 2], b: &[f64; 2]| (a[0] < b[0]) | ((a[0] == b[0]) & (a[1] < b[1]));
    if is_less(a, b) {
        Ordering::Less
    } else if is_less(b, a) {
        Ordering::Greater
    } else {
        Ordering::Equal
    }
}

use super::runs::{Run, length_of_run};

/// Calls `visit(u, v, label)` for pixels on the rim of a labelled region, next to another label, to no label,
/// or to the border of the image; on every `stride`-th row and every `stride`-th column. Row by row; `runs`
/// are the runs of the labels.
pub(super) fn visit_rims(
    labels: &[u16],
    width: usize,
    runs: &[Run],
    stride: usize,
    mut visit: impl FnMut(usize, usize, u16),
) {
    let height = labels.len() / width;
    for run in runs {
        let (v, first, last) = (run.v as usize, run.first as usize, run.end as usize - 1);
        let row = v * width;
        let ends_along_column = |u: usize| {
            (v == 0 || labels[row - width + u] != run.label)
                || (v + 1 == height || labels[row + width + u] != run.label)
        };
        let has_ends = v.is_multiple_of(stride);
        if has_ends {
            visit(first, v, run.label);
        }
        // Inside a region, the rows above and below have the same label all along.
        let goes_on = |row: usize| length_of_run(&labels[row + first..=row + last], run.label) > last - first;
        if v == 0 || v + 1 == height || !goes_on(row - width) || !goes_on(row + width) {
            for u in (first.next_multiple_of(stride)..=last).step_by(stride) {
                let is_end = has_ends && (u == first || u == last);
                if !is_end && ends_along_column(u) {
                    visit(u, v, run.label);
                }
            }
        }
        if has_ends && last > first {
            visit(last, v, run.label);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::runs::find_runs;
    use super::*;

    #[test]
    fn walks_round_a_square_and_its_hole() {
        // 6x6 pixels of label 3 in an image of 8x8, with one pixel missing in the middle.
        let mut labels = [0_u16; 64];
        for v in 1..7 {
            labels[v * 8 + 1..v * 8 + 7].fill(3);
        }
        labels[3 * 8 + 3] = 0;
        let mut runs = Vec::new();
        find_runs(&labels, 8, &mut runs);
        let mut rim = Vec::new();
        visit_rims(&labels, 8, &runs, 1, |u, v, label| rim.push((u, v, label)));
        let mut expected = Vec::new();
        for v in 1..7 {
            for u in 1..7 {
                let outer = v == 1 || v == 6 || u == 1 || u == 6;
                let hole = [(2, 3), (4, 3), (3, 2), (3, 4)].contains(&(u, v));
                if outer || hole {
                    expected.push((u, v, 3));
                }
            }
        }
        assert_eq!(rim, expected);
        let mut sparse = Vec::new();
        visit_rims(&labels, 8, &runs, 4, |u, v, _| sparse.push((u, v)));
        assert_eq!(sparse, [(4, 1), (1, 4), (6, 4), (4, 6)]);
    }
}

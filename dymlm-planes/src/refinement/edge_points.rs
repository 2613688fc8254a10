/// Calls `visit(u, v, label)` for pixels on the rim of a labelled region: next to another label, or to none, or to the end of
/// the image; every `stride`-th row, and every `stride`-th column. Row by row.
pub(super) fn visit_rims(
    labels: &[u16],
    width: usize,
    stride: usize,
    mut visit: impl FnMut(usize, usize, u16),
) {
    let mut row_above: &[u16] = &[];
    for (v, row) in labels.chunks_exact(width).enumerate() {
        let row_below = labels.get((v + 1) * width..(v + 2) * width).unwrap_or(&[]);
        let ends_along_column =
            |u: usize| row_above.get(u) != Some(&row[u]) || row_below.get(u) != Some(&row[u]);
        if v % stride == 0 {
            let ends_along_row = |u: usize| u == 0 || row[u - 1] != row[u] || row.get(u + 1) != Some(&row[u]);
            for (u, &label) in row.iter().enumerate() {
                if label != 0 && (ends_along_row(u) || (u % stride == 0 && ends_along_column(u))) {
                    visit(u, v, label);
                }
            }
        } else {
            for u in (0..width).step_by(stride) {
                if row[u] != 0 && ends_along_column(u) {
                    visit(u, v, row[u]);
                }
            }
        }
        row_above = row;
    }
}

/// How many of the 5x5 pixels around (u, v) have its label, as a share of 25.
pub(super) fn fill_around(labels: &[u16], width: usize, u: usize, v: usize) -> f64 {
    let label = labels[v * width + u];
    let height = labels.len() / width;
    let columns = u.saturating_sub(2)..(u + 3).min(width);
    let own: usize = (v.saturating_sub(2)..(v + 3).min(height))
        .map(|v| &labels[v * width + columns.start..v * width + columns.end])
        .map(|row| row.iter().filter(|&&other| other == label).count())
        .sum();
    own as f64 / 25.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_round_a_square_and_its_hole() {
        // 6x6 pixels of label 3 in an image of 8x8, with one pixel missing in the middle.
        let mut labels = [0_u16; 64];
        for v in 1..7 {
            labels[v * 8 + 1..v * 8 + 7].fill(3);
        }
        labels[3 * 8 + 3] = 0;
        let mut rim = Vec::new();
        visit_rims(&labels, 8, 1, |u, v, label| rim.push((u, v, label)));
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
        visit_rims(&labels, 8, 4, |u, v, _| sparse.push((u, v)));
        assert_eq!(sparse, [(4, 1), (1, 4), (6, 4), (4, 6)]);
        assert_eq!(fill_around(&labels, 8, 1, 1), 8.0 / 25.0);
        assert_eq!(fill_around(&labels, 8, 5, 5), 15.0 / 25.0);
    }
}

/// Neighbouring pixels of one row with the same label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    /// The label, never 0.
    pub(super) label: u16,
    pub(super) v: u32,
    pub(super) first: u32,
    pub(super) end: u32,
}

/// The runs of a label image, row by row. O(pixels).
pub(super) fn find_runs(labels: &[u16], width: usize, out: &mut Vec<Run>) {
    out.clear();
    for (v, row) in labels.chunks_exact(width).enumerate() {
        let mut first = 0;
        for run in row.chunk_by(|a, b| a == b) {
            let end = first + run.len();
            if run[0] != 0 {
                out.push(Run { label: run[0], v: v as u32, first: first as u32, end: end as u32 });
            }
            first = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_rows_at_changes_and_ends() {
        let mut runs = Vec::new();
        find_runs(&[0, 1, 1, 1, 2, 2], 3, &mut runs);
        let run = |label, v, first, end| Run { label, v, first, end };
        assert_eq!(runs, [run(1, 0, 1, 3), run(1, 1, 0, 1), run(2, 1, 1, 3)]);
    }
}

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
        while let Some(&label) = row.get(first) {
            let end = first + length_of_run(&row[first..], label);
            if label != 0 {
                out.push(Run { label, v: v as u32, first: first as u32, end: end as u32 });
            }
            first = end;
        }
    }
}

/// Number of leading labels that equal `label`; compared many at a time.
fn length_of_run(labels: &[u16], label: u16) -> usize {
    const MANY: usize = 16;
    let (chunks, _) = labels.as_chunks::<MANY>();
    let whole = MANY * chunks.iter().take_while(|chunk| **chunk == [label; MANY]).count();
    whole + labels[whole..].iter().take_while(|&&other| other == label).count()
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

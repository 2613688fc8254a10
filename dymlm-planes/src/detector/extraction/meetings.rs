use super::block_grid::BlockGrid;

/// Two labels whose pixels touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Meeting {
    /// The smaller label first.
    pub(super) labels: [u16; 2],
    /// Number of pairs of neighbouring pixels, along rows and columns, with these two labels.
    pub(super) contact: u32,
}

impl Meeting {
    pub(super) fn new([a, b]: [u16; 2], contact: u32) -> Self {
        Self { labels: [a.min(b), a.max(b)], contact }
    }
}

/// Adds the pairs of labels that meet at the pixels of a block, each pair once.
pub(super) fn find_meetings(
    grid: &BlockGrid,
    block: usize,
    pixel_labels: &[u16],
    meetings: &mut Vec<Meeting>,
) {
    let known = meetings.len();
    for v in grid.pixel_rows(block) {
        for u in grid.pixel_columns(block) {
            let pixel = v * grid.width + u;
            let label = pixel_labels[pixel];
            let right = if u + 1 < grid.width { pixel_labels[pixel + 1] } else { 0 };
            let below = pixel_labels.get(pixel + grid.width).copied().unwrap_or(0);
            for other in [right, below] {
                if label == 0 || other == 0 || other == label {
                    continue;
                }
                let found = Meeting::new([label, other], 1);
                match meetings[known..].iter_mut().find(|meeting| meeting.labels == found.labels) {
                    Some(meeting) => meeting.contact += 1,
                    None => meetings.push(found),
                }
            }
        }
    }
}

/// Joins the meetings of the same labels and keeps those with enough contact, sorted by labels.
pub(super) fn keep_close(meetings: &mut Vec<Meeting>, least_contact: u32) {
    meetings.sort_unstable();
    meetings.dedup_by(|next, kept| {
        let same = next.labels == kept.labels;
        kept.contact += if same { next.contact } else { 0 };
        same
    });
    meetings.retain(|meeting| meeting.contact >= least_contact);
}

/// The largest number that is counted to: more key frames, at their full weight, than a week has at 3 Hz.
/// Counts stop there, so that whatever is saved can be loaded, and a damaged file is told by larger ones.
pub(crate) const MOST_COUNTED: u32 = (1 << 31) - 1;

/// A sum of counts.
pub(crate) fn counted(count: u32, more: u32) -> u32 {
    count.saturating_add(more).min(MOST_COUNTED)
}

use dymlm_core::{BoundingBox, ColorImage};

/// Bins a channel of a colour histogram.
const BINS: usize = 4;

/// How the object is coloured: a histogram of 4x4x4 colours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Appearance {
    share: Vec<f64>,
}

impl Appearance {
    /// Of the pixels in a box that `chosen` says belong to the object; `None` when there are none.
    pub(super) fn of(
        color: &ColorImage,
        region: BoundingBox,
        chosen: impl Fn(usize, usize) -> bool,
    ) -> Option<Self> {
        let mut share = vec![0.0; BINS * BINS * BINS];
        let mut count = 0.0;
        for v in region.rows(color.height()) {
            for u in region.columns(color.width()).filter(|&u| chosen(u, v)) {
                let bin = color.at(u, v)?.iter().fold(0, |bin, &c| bin * BINS + usize::from(c) * BINS / 256);
                share[bin] += 1.0;
                count += 1.0;
            }
        }
        for s in &mut share {
            *s /= count;
        }
        (count > 0.0).then_some(Self { share })
    }

    /// Bhattacharyya coefficient, 0..=1.
    pub(super) fn likeness(&self, other: &Self) -> f64 {
        self.share.iter().zip(&other.share).map(|(a, b)| (a * b).sqrt()).sum()
    }
}

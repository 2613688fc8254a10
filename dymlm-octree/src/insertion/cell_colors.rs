use dymlm_core::Rgb;

use super::sparse_marks::IntegerMap;
use crate::lattice::{Key, pack};

/// Sums of the colours of a scan's readings, for each cell hit.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellColors {
    sums: IntegerMap<ColorSum>,
    /// The cells in the order in which they were first hit.
    cells: Vec<Key>,
    /// Sum of the last readings, which share one cell. Neighbouring pixels mostly do: a run of them is summed
    /// before its cell is looked up.
    run: Option<(Key, ColorSum)>,
}

#[derive(Debug, Clone, Copy, Default)]
struct ColorSum {
    channels: [u64; 3],
    count: u64,
}

impl ColorSum {
    fn add(&mut self, other: Self) {
        for (sum, channel) in self.channels.iter_mut().zip(other.channels) {
            *sum += channel;
        }
        self.count += other.count;
    }
}

impl CellColors {
    #[inline]
    pub(crate) fn add(&mut self, key: Key, color: Rgb) {
        let one = ColorSum { channels: color.map(u64::from), count: 1 };
        match &mut self.run {
            Some((last, sum)) if *last == key => sum.add(one),
            _ => {
                self.end_run();
                self.run = Some((key, one));
            }
        }
    }

    fn end_run(&mut self) {
        if let Some((key, sum)) = self.run.take() {
            let total = self.sums.entry(pack(key)).or_default();
            if total.count == 0 {
                self.cells.push(key);
            }
            total.add(sum);
        }
    }

    /// Hands over each cell and its mean colour, and forgets them.
    pub(crate) fn drain(&mut self, mut f: impl FnMut(Key, Rgb)) {
        self.end_run();
        for &key in &self.cells {
            if let Some(sum) = self.sums.get(&pack(key)) {
                f(key, sum.channels.map(|channel| (channel / sum.count) as u8));
            }
        }
        self.sums.clear();
        self.cells.clear();
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.sums.capacity() * size_of::<(u64, ColorSum)>() + self.cells.capacity() * size_of::<Key>()
    }
}

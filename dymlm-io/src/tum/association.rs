use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// A colour image and a depth image of nearly the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Pair {
    /// Index into the list of colour images.
    pub(crate) color: usize,
    /// Index into the list of depth images.
    pub(crate) depth: usize,
}

/// Pairs colour and depth images by their times, one to one: the closest pair at most `max_gap` seconds apart
/// is taken first, then the closest of those that are left, and so on (the benchmark's `associate.py`). Of
/// equally close pairs the earlier is taken first. Both lists are in time order, and so is the result.
///
/// The closest remaining pair is always a pair of neighbours in time. O(n log n) for n images, however many
/// pairs are within the gap.
pub(crate) fn associate(color: &[f64], depth: &[f64], max_gap: f64) -> Vec<Pair> {
    let mut moments = Moments::of(color, depth);
    let mut pairs = moments.pair_simultaneous();
    let mut open = BinaryHeap::new();
    for moment in 0..moments.all.len() {
        open.extend(moments.closest_with_next(moment, max_gap));
    }
    while let Some(Reverse(candidate)) = open.pop() {
        let [first, second] = candidate.moments;
        // A pair taken earlier may have used one of the two images.
        if moments.closest_with_next(first, max_gap) != Some(Reverse(candidate)) {
            continue;
        }
        pairs.push(Pair { color: candidate.color, depth: candidate.depth });
        for moment in [first, second] {
            moments.take(moment);
        }
        let before = moments.all[first].previous;
        for moment in [before, Some(first), Some(second)].into_iter().flatten() {
            open.extend(moments.closest_with_next(moment, max_gap));
        }
    }
    pairs.sort_unstable_by_key(|pair| pair.depth);
    pairs
}

/// The images of one time that are not paired yet.
#[derive(Debug, Clone)]
struct Moment {
    timestamp: f64,
    color: Range<usize>,
    depth: Range<usize>,
    /// The moments before and after this one that still have images.
    previous: Option<usize>,
    next: Option<usize>,
}

/// All moments, in time order.
struct Moments {
    all: Vec<Moment>,
}

/// A pair that two neighbouring moments can make, ordered by closeness, then by colour image, then by depth
/// image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// Bits of the time between them. The time is not negative, so its bits sort in the same order.
    gap: u64,
    color: usize,
    depth: usize,
    moments: [usize; 2],
}

impl Moments {
    fn of(color: &[f64], depth: &[f64]) -> Self {
        let mut all: Vec<Moment> = Vec::with_capacity(color.len() + depth.len());
        let (mut c, mut d) = (0, 0);
        loop {
            let times = [color.get(c), depth.get(d)];
            let Some(timestamp) = times.into_iter().flatten().copied().reduce(f64::min) else { break };
            let ends = |files: &[f64], from: usize| {
                from + files[from..].iter().take_while(|&&time| time <= timestamp).count()
            };
            let (color_end, depth_end) = (ends(color, c), ends(depth, d));
            all.push(Moment {
                timestamp,
                color: c..color_end,
                depth: d..depth_end,
                previous: all.len().checked_sub(1),
                next: Some(all.len() + 1),
            });
            (c, d) = (color_end, depth_end);
        }
        if let Some(last) = all.last_mut() {
            last.next = None;
        }
        Self { all }
    }

    /// Pairs images of exactly the same time: no image is closer to another.
    fn pair_simultaneous(&mut self) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for moment in 0..self.all.len() {
            let Moment { color, depth, .. } = &mut self.all[moment];
            let both = color.len().min(depth.len());
            pairs.extend(
                color
                    .by_ref()
                    .take(both)
                    .zip(depth.by_ref().take(both))
                    .map(|(color, depth)| Pair { color, depth }),
            );
            self.unlink_if_empty(moment);
        }
        pairs
    }

    /// The pair that a moment makes with the next moment, if they can make one.
    fn closest_with_next(&self, first: usize, max_gap: f64) -> Option<Reverse<Candidate>> {
        let second = self.all[first].next?;
        let [a, b] = [&self.all[first], &self.all[second]];
        let (color, depth) = if a.depth.is_empty() { (&a.color, &b.depth) } else { (&b.color, &a.depth) };
        if color.is_empty() || depth.is_empty() || b.timestamp - a.timestamp > max_gap {
            return None;
        }
        let gap = (b.timestamp - a.timestamp).to_bits();
        Some(Reverse(Candidate { gap, color: color.start, depth: depth.start, moments: [first, second] }))
    }

    /// Removes the first image of a moment whose images are all of one kind.
    fn take(&mut self, moment: usize) {
        let Moment { color, depth, .. } = &mut self.all[moment];
        let _ = color.next().or_else(|| depth.next());
        self.unlink_if_empty(moment);
    }

    fn unlink_if_empty(&mut self, moment: usize) {
        let Moment { color, depth, previous, next, .. } = self.all[moment].clone();
        if !color.is_empty() || !depth.is_empty() {
            return;
        }
        if let Some(previous) = previous {
            self.all[previous].next = next;
        }
        if let Some(next) = next {
            self.all[next].previous = previous;
        }
        self.all[moment].next = None;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pairs(color: &[f64], depth: &[f64]) -> Vec<(usize, usize)> {
        associate(color, depth, 0.02).iter().map(|pair| (pair.color, pair.depth)).collect()
    }

    #[test]
    fn takes_the_closest_pair_first() {
        // Colour 0 is the nearest to both depth images, and depth 1 is the nearer of the two.
        assert_eq!(pairs(&[0.010], &[0.000, 0.015]), [(0, 1)]);
        assert_eq!(pairs(&[0.0, 0.033, 0.066], &[0.010, 0.040, 0.2]), [(0, 0), (1, 1)]);
        assert_eq!(pairs(&[], &[0.0]), []);
    }

    /// The benchmark's `associate.py`, literally: all pairs are sorted, and taken while both images are free.
    fn associate_py(color: &[f64], depth: &[f64], max_gap: f64) -> Vec<(usize, usize)> {
        let mut potential: Vec<(f64, usize, usize)> = Vec::new();
        for (c, &a) in color.iter().enumerate() {
            for (d, &b) in depth.iter().enumerate() {
                if (a - b).abs() <= max_gap {
                    potential.push(((a - b).abs(), c, d));
                }
            }
        }
        potential.sort_by(|x, y| x.partial_cmp(y).unwrap());
        let mut matches: Vec<(usize, usize)> = Vec::new();
        for (_, c, d) in potential {
            if matches.iter().all(|&(c0, d0)| c0 != c && d0 != d) {
                matches.push((c, d));
            }
        }
        matches.sort_by_key(|&(_, d)| d);
        matches
    }

    proptest! {
        #[test]
        fn equals_the_benchmarks_own(
            mut color in prop::collection::vec(0.0..1.0_f64, 0..60),
            mut depth in prop::collection::vec(0.0..1.0_f64, 0..60),
        ) {
            color.sort_by(f64::total_cmp);
            depth.sort_by(f64::total_cmp);
            prop_assert_eq!(pairs(&color, &depth), associate_py(&color, &depth, 0.02));
        }

        /// Times that often coincide, and gaps that often equal the limit.
        #[test]
        fn equals_the_benchmarks_own_where_times_coincide(
            mut color in prop::collection::vec(0..24_u8, 0..40),
            mut depth in prop::collection::vec(0..24_u8, 0..40),
            gap in 0..5_u8,
        ) {
            color.sort_unstable();
            depth.sort_unstable();
            let times = |steps: &[u8]| steps.iter().map(|&step| f64::from(step) / 16.0).collect::<Vec<_>>();
            let (color, depth, gap) = (times(&color), times(&depth), f64::from(gap) / 16.0);
            let found: Vec<_> =
                associate(&color, &depth, gap).iter().map(|pair| (pair.color, pair.depth)).collect();
            prop_assert_eq!(found, associate_py(&color, &depth, gap));
        }
    }
}

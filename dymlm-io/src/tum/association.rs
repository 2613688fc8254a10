use super::list_file::ListedFile;

/// A colour image and a depth image of about the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pair {
    /// Index into the list of colour images.
    pub(super) color: usize,
    /// Index into the list of depth images.
    pub(super) depth: usize,
}

/// Pairs colour images and depth images by time, one to one: of all pairs at most `max_gap` seconds apart the
/// closest is taken first, then the closest of those that are left, and so on (the benchmark's
/// `associate.py`). Pairs equally close are taken in time order. Both lists are in time order, and so is the
/// result.
///
/// O(k log k) for k pairs within the gap.
pub(super) fn associate(color: &[ListedFile], depth: &[ListedFile], max_gap: f64) -> Vec<Pair> {
    let mut candidates = pairs_within(color, depth, max_gap);
    let gap = |pair: &Pair| (color[pair.color].timestamp - depth[pair.depth].timestamp).abs();
    candidates
        .sort_by(|a, b| gap(a).total_cmp(&gap(b)).then(a.color.cmp(&b.color)).then(a.depth.cmp(&b.depth)));
    let mut color_taken = vec![false; color.len()];
    let mut depth_taken = vec![false; depth.len()];
    candidates.retain(|pair| {
        let free = !color_taken[pair.color] && !depth_taken[pair.depth];
        if free {
            color_taken[pair.color] = true;
            depth_taken[pair.depth] = true;
        }
        free
    });
    candidates.sort_by_key(|pair| pair.depth);
    candidates
}

/// All pairs at most `max_gap` seconds apart.
fn pairs_within(color: &[ListedFile], depth: &[ListedFile], max_gap: f64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    let mut first = 0;
    for (d, depth_file) in depth.iter().enumerate() {
        while color.get(first).is_some_and(|file| depth_file.timestamp - file.timestamp > max_gap) {
            first += 1;
        }
        let near = color.iter().enumerate().skip(first);
        pairs.extend(
            near.take_while(|(_, file)| file.timestamp - depth_file.timestamp <= max_gap)
                .map(|(c, _)| Pair { color: c, depth: d }),
        );
    }
    pairs
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(times: &[f64]) -> Vec<ListedFile> {
        let file = |&timestamp| ListedFile { timestamp, path: "x".into(), line: 1 };
        times.iter().map(file).collect()
    }

    fn pairs(color: &[f64], depth: &[f64]) -> Vec<(usize, usize)> {
        associate(&at(color), &at(depth), 0.02).iter().map(|pair| (pair.color, pair.depth)).collect()
    }

    #[test]
    fn takes_the_closest_pair_first() {
        // Depth 0 is nearest to colour 0, but depth 1 is nearer to it still.
        assert_eq!(pairs(&[0.010], &[0.000, 0.015]), [(0, 1)]);
        assert_eq!(pairs(&[0.0, 0.033, 0.066], &[0.010, 0.040, 0.2]), [(0, 0), (1, 1)]);
        assert_eq!(pairs(&[], &[0.0]), []);
    }

    /// The benchmark's `associate.py`, literally: all pairs, sorted, taken while both are free.
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
    }
}

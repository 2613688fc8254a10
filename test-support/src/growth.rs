use std::time::{Duration, Instant};

/// Each size is timed at least and at most so often.
const FEWEST_RUNS: usize = 3;
const MOST_RUNS: usize = 15;

/// How many times as long `work` takes on the larger of two inputs as on the smaller one, with `most` the
/// largest ratio that is right.
///
/// The shortest of several runs counts, the two sizes in turn, so that a busy machine slows both. A ratio above
/// `most` is timed again: other programs only ever make a run longer, so that the shortest runs come to what
/// the work takes. To be held against the growth of the input: 8 times the input take 8 times as long by O(n),
/// some 11 times by O(n log n), and 64 times by O(n²).
pub fn growth<T, R>(most: f64, small: &T, large: &T, mut work: impl FnMut(&T) -> R) -> f64 {
    let mut shortest = [Duration::MAX; 2];
    let mut ratio = f64::INFINITY;
    for run in 1..=MOST_RUNS {
        for (shortest, input) in shortest.iter_mut().zip([small, large]) {
            let start = Instant::now();
            std::hint::black_box(work(std::hint::black_box(input)));
            *shortest = start.elapsed().min(*shortest);
        }
        ratio = shortest[1].as_secs_f64() / shortest[0].as_secs_f64().max(1e-9);
        if run >= FEWEST_RUNS && ratio <= most {
            break;
        }
    }
    ratio
}

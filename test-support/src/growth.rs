use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::processor_time;

/// Each size is timed at least and at most so often.
const FEWEST_RUNS: usize = 3;
const MOST_RUNS: usize = 15;

/// How many times as long `work` takes on the larger of two inputs as on the smaller one, with `most` the
/// largest ratio that is right.
///
/// The processor's time counts, and of several runs the shortest, so that a busy machine hardly matters. A
/// ratio above `most` is timed again: whatever else this process does only ever makes a run longer. To be held
/// against the growth of the input: 8 times the input take 8 times as long by O(n), some 11 times by O(n log
/// n), and 64 times by O(n²).
pub fn growth<T, R>(most: f64, small: &T, large: &T, mut work: impl FnMut(&T) -> R) -> f64 {
    // Tests run on several threads, and the clock counts all of them.
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut shortest = [Duration::MAX; 2];
    let mut ratio = f64::INFINITY;
    for run in 1..=MOST_RUNS {
        for (shortest, input) in shortest.iter_mut().zip([small, large]) {
            let start = processor_time();
            std::hint::black_box(work(std::hint::black_box(input)));
            *shortest = processor_time().saturating_sub(start).min(*shortest);
        }
        ratio = shortest[1].as_secs_f64() / shortest[0].as_secs_f64().max(1e-9);
        if run >= FEWEST_RUNS && ratio <= most {
            break;
        }
    }
    ratio
}

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::processor_time;

/// Each size is timed at least and at most this often.
const FEWEST_RUNS: usize = 3;
const MOST_RUNS: usize = 15;

/// The ratio of the times that `work` takes on the larger and on the smaller of two inputs; `most` is the
/// largest ratio that passes.
///
/// Processor time is measured, and the shortest of several runs counts, so that a busy machine hardly
/// matters. A ratio above `most` is measured again, since other work of this process can only make a run
/// longer. Compare the ratio with the growth of the input: 8 times the input takes 8 times as long in O(n),
/// some 11 times in O(n log n), and 64 times in O(n²).
pub fn growth<T, R>(most: f64, small: &T, large: &T, mut work: impl FnMut(&T) -> R) -> f64 {
    // Tests run on several threads, and processor time counts all of them.
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

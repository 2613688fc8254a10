use std::time::Duration;

use crate::processor_time::thread_time;

/// Each size is timed at least and at most this often.
const FEWEST_RUNS: usize = 3;
const MOST_RUNS: usize = 15;

/// The ratio of the times that `work` takes on the larger and on the smaller of two inputs; `most` is the
/// largest ratio that passes.
///
/// The processor time of one thread is measured, in which `work` runs whole, and the shortest of several runs
/// counts: other tests and other programs hardly matter. A ratio above `most` is measured again, since they can
/// only make a run longer. Compare the ratio with the growth of the input: 8 times the input takes 8 times as
/// long in O(n), some 11 times in O(n log n), and 64 times in O(n²).
pub fn growth<T: Sync, R>(most: f64, small: &T, large: &T, work: impl FnMut(&T) -> R + Send) -> f64 {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    alone.install(|| growth_on_this_thread(most, [small, large], work))
}

fn growth_on_this_thread<T, R>(most: f64, inputs: [&T; 2], mut work: impl FnMut(&T) -> R) -> f64 {
    let mut shortest = [Duration::MAX; 2];
    let mut ratio = f64::INFINITY;
    for run in 1..=MOST_RUNS {
        for (shortest, input) in shortest.iter_mut().zip(inputs) {
            let start = thread_time();
            std::hint::black_box(work(std::hint::black_box(input)));
            *shortest = thread_time().saturating_sub(start).min(*shortest);
        }
        ratio = shortest[1].as_secs_f64() / shortest[0].as_secs_f64().max(1e-9);
        if run >= FEWEST_RUNS && ratio <= most {
            break;
        }
    }
    ratio
}

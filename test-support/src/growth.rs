use std::time::{Duration, Instant};

/// How many times as long `work` takes on the larger of two inputs as on the smaller one.
///
/// The shortest of several runs counts, the two sizes in turn, so that a busy machine slows both. To be held
/// against the growth of the input: 8 times the input take 8 times as long by O(n), some 11 times by O(n log
/// n), and 64 times by O(n²).
pub fn growth<T, R>(small: &T, large: &T, mut work: impl FnMut(&T) -> R) -> f64 {
    const RUNS: usize = 5;
    let mut shortest = [Duration::MAX; 2];
    for _ in 0..RUNS {
        for (shortest, input) in shortest.iter_mut().zip([small, large]) {
            let start = Instant::now();
            std::hint::black_box(work(std::hint::black_box(input)));
            *shortest = start.elapsed().min(*shortest);
        }
    }
    shortest[1].as_secs_f64() / shortest[0].as_secs_f64().max(1e-9)
}

//! The one place that knows whether work is spread over threads. Results never depend on it.

/// Runs `work` on each task, with feature `parallel` on rayon's threads.
#[cfg(feature = "parallel")]
pub(crate) fn for_each<T: Send>(tasks: impl Iterator<Item = T>, work: impl Fn(T) + Send + Sync) {
    use rayon::prelude::*;
    tasks.collect::<Vec<_>>().into_par_iter().for_each(work);
}

/// Runs `work` on each task, with feature `parallel` on rayon's threads.
#[cfg(not(feature = "parallel"))]
pub(crate) fn for_each<T>(tasks: impl Iterator<Item = T>, work: impl Fn(T)) {
    tasks.for_each(work);
}

/// How many of `items` make a task: all of them, or with feature `parallel` a share that evens out the load.
pub(crate) fn task_size(items: usize) -> usize {
    let tasks = if cfg!(feature = "parallel") { 64 } else { 1 };
    items.div_ceil(tasks).max(1)
}

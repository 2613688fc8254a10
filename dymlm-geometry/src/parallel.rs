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

/// Applies `work` to each task and gives the results in order, with feature `parallel` on rayon's threads.
#[cfg(feature = "parallel")]
pub(crate) fn map<T: Send, R: Send>(tasks: Vec<T>, work: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    use rayon::prelude::*;
    tasks.into_par_iter().map(work).collect()
}

/// Applies `work` to each task and gives the results in order, with feature `parallel` on rayon's threads.
#[cfg(not(feature = "parallel"))]
pub(crate) fn map<T, R>(tasks: Vec<T>, work: impl Fn(T) -> R) -> Vec<R> {
    tasks.into_iter().map(work).collect()
}

/// How many of `items` make a task: all of them, or with feature `parallel` a share that evens out the load.
pub(crate) fn task_size(items: usize) -> usize {
    let tasks = if cfg!(feature = "parallel") { 64 } else { 1 };
    items.div_ceil(tasks).max(1)
}

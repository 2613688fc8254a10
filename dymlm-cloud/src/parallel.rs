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

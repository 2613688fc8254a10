/// Applies `work` to each task on rayon's threads (feature `parallel`), and returns the results in order.
#[cfg(feature = "parallel")]
pub(crate) fn map<T: Send, R: Send>(tasks: Vec<T>, work: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    use rayon::prelude::*;
    tasks.into_par_iter().map(work).collect()
}

/// Applies `work` to each task, and returns the results in order.
#[cfg(not(feature = "parallel"))]
pub(crate) fn map<T, R>(tasks: Vec<T>, work: impl Fn(T) -> R) -> Vec<R> {
    tasks.into_iter().map(work).collect()
}

/// Runs both, at the same time if a thread is free (feature `parallel`).
#[cfg(feature = "parallel")]
pub(crate) fn join<A: Send, B: Send>(
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(first, second)
}

/// Runs both, one after the other.
#[cfg(not(feature = "parallel"))]
pub(crate) fn join<A, B>(first: impl FnOnce() -> A, second: impl FnOnce() -> B) -> (A, B) {
    (first(), second())
}

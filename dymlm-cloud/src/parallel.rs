#[cfg(feature = "parallel")]
thread_local! {
    /// How many computations this thread must do alone.
    static ALONE: std::cell::Cell<u32> = const { std::cell::Cell::new(0) };
}

/// From now on this thread works alone, until [`end_alone`].
pub(crate) fn begin_alone() {
    #[cfg(feature = "parallel")]
    ALONE.set(ALONE.get() + 1);
}

/// Ends what [`begin_alone`] has begun.
pub(crate) fn end_alone() {
    #[cfg(feature = "parallel")]
    ALONE.set(ALONE.get().saturating_sub(1));
}

/// Applies `work` to each task and returns the results in order, on rayon's threads (feature `parallel`).
pub(crate) fn map<T: Send, R: Send>(tasks: Vec<T>, work: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    map_with(tasks, || (), |(), task| work(task))
}

/// As [`map`], with a scratch that is made for each thread, once or more often.
#[cfg(feature = "parallel")]
pub(crate) fn map_with<S, T: Send, R: Send>(
    tasks: Vec<T>,
    scratch: impl Fn() -> S + Send + Sync,
    work: impl Fn(&mut S, T) -> R + Send + Sync,
) -> Vec<R> {
    use rayon::prelude::*;
    if ALONE.get() > 0 {
        return map_in_turn(tasks, scratch(), work);
    }
    tasks.into_par_iter().map_init(scratch, work).collect()
}

/// As [`map`], with a scratch that is made once.
#[cfg(not(feature = "parallel"))]
pub(crate) fn map_with<S, T, R>(
    tasks: Vec<T>,
    scratch: impl Fn() -> S,
    work: impl Fn(&mut S, T) -> R,
) -> Vec<R> {
    map_in_turn(tasks, scratch(), work)
}

fn map_in_turn<S, T, R>(tasks: Vec<T>, mut scratch: S, work: impl Fn(&mut S, T) -> R) -> Vec<R> {
    tasks.into_iter().map(|task| work(&mut scratch, task)).collect()
}

/// Lets a thread of rayon's that waits do what others have asked of the pool; `false` on any other thread, which
/// should wait by blocking.
#[cfg(feature = "parallel")]
pub(crate) fn helps_others() -> bool {
    let did = rayon::yield_now();
    if did == Some(rayon::Yield::Idle) {
        std::thread::yield_now();
    }
    did.is_some()
}

/// `false`: there is no pool.
#[cfg(not(feature = "parallel"))]
pub(crate) fn helps_others() -> bool {
    false
}

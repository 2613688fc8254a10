use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Disjoint sets of 0..n. The root of a set is its least element.
///
/// Threads may join sets at the same time. A parent is never greater than its child, so that a chain of
/// parents, even one read while others write, ends at a root; and which elements share a set in the end does
/// not depend on the order of the joins. Orderings are relaxed: nothing but the parents themselves passes
/// between threads.
#[derive(Debug, Default)]
pub(super) struct UnionFind {
    parents: Vec<AtomicU32>,
}

impl UnionFind {
    /// Makes `count` sets of one element each.
    pub(super) fn reset(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend((0..count as u32).map(AtomicU32::new));
    }

    /// The root of an element's set; while other threads join sets, some element of the set.
    #[inline]
    pub(super) fn root(&self, element: usize) -> usize {
        let mut element = element as u32;
        loop {
            let parent = self.parent(element);
            if parent == element {
                return element as usize;
            }
            // Path halving: a grandparent is as good a parent.
            let grandparent = self.parent(parent);
            if grandparent != parent {
                self.parents[element as usize].store(grandparent, Relaxed);
            }
            element = grandparent;
        }
    }

    /// Joins the sets of two elements.
    pub(super) fn join(&self, a: usize, b: usize) {
        loop {
            let (a, b) = (self.root(a), self.root(b));
            let (low, high) = (a.min(b), a.max(b));
            if low == high {
                return;
            }
            // Fails when another thread has joined `high` to something in the meantime.
            let root = &self.parents[high];
            if root.compare_exchange(high as u32, low as u32, Relaxed, Relaxed).is_ok() {
                return;
            }
        }
    }

    /// Makes every element the child of its root.
    pub(super) fn flatten(&mut self) {
        for element in 0..self.parents.len() {
            // Parents are not greater, so the parent is flat already.
            let grandparent = self.parent(self.parent(element as u32));
            *self.parents[element].get_mut() = grandparent;
        }
    }

    #[inline]
    fn parent(&self, element: u32) -> u32 {
        self.parents[element as usize].load(Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joins_by_the_least_element() {
        let mut sets = UnionFind::default();
        sets.reset(7);
        for (a, b) in [(5, 6), (3, 5), (1, 2), (6, 3)] {
            sets.join(a, b);
        }
        let roots = |sets: &UnionFind| (0..7).map(|element| sets.root(element)).collect::<Vec<_>>();
        assert_eq!(roots(&sets), [0, 1, 1, 3, 4, 3, 3]);
        sets.join(2, 6);
        sets.flatten();
        assert_eq!(roots(&sets), [0, 1, 1, 1, 4, 1, 1]);
        assert!((0..7).all(|element| sets.parent(element) as usize == sets.root(element as usize)));
    }

    #[test]
    fn threads_agree_with_one_thread() {
        const COUNT: usize = 2000;
        let edges: Vec<(usize, usize)> =
            (0..COUNT).map(|i| (i, (i * 7919 + 13) % COUNT)).filter(|e| e.0 % 3 != 0).collect();
        let mut alone = UnionFind::default();
        alone.reset(COUNT);
        for &(a, b) in &edges {
            alone.join(a, b);
        }
        let mut together = UnionFind::default();
        together.reset(COUNT);
        std::thread::scope(|scope| {
            for share in edges.chunks(edges.len() / 4) {
                let together = &together;
                scope.spawn(move || share.iter().for_each(|&(a, b)| together.join(a, b)));
            }
        });
        assert!((0..COUNT).all(|element| alone.root(element) == together.root(element)));
    }
}

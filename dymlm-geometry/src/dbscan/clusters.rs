/// Greater than the number of any cluster and the index of any point.
pub(super) const NO_CLUSTER: u32 = u32::MAX;

/// The clusters of a cloud: for each point the number of its cluster, or none.
///
/// Clusters are numbered from 0 in the order of their first core points in the cloud.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Clusters {
    pub(super) labels: Vec<Option<u32>>,
    pub(super) sizes: Vec<usize>,
}

impl Clusters {
    /// The cluster of each point, in the order of the cloud; `None` is noise.
    #[inline]
    pub fn labels(&self) -> &[Option<u32>] {
        &self.labels
    }

    /// Number of clusters.
    #[inline]
    pub fn count(&self) -> usize {
        self.sizes.len()
    }

    /// Number of points in each cluster, border points included.
    #[inline]
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Number of points in no cluster.
    pub fn noise(&self) -> usize {
        self.labels.len() - self.sizes.iter().sum::<usize>()
    }

    /// The largest cluster, the first one among equals; `None` when there is none.
    pub fn largest(&self) -> Option<u32> {
        (0..)
            .zip(&self.sizes)
            .max_by_key(|&(label, size)| (*size, std::cmp::Reverse(label)))
            .map(|(label, _)| label)
    }

    /// Indices of the points of a cluster, ascending; none for a label that no cluster has. O(points).
    pub fn members(&self, label: u32) -> impl Iterator<Item = usize> + '_ {
        self.labels.iter().enumerate().filter(move |(_, own)| **own == Some(label)).map(|(index, _)| index)
    }
}

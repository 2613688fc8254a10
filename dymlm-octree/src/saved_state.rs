use dymlm_core::StateSink;

use crate::storage::Tree;
use crate::{Error, Octree, OctreeConfig};

impl Octree {
    /// Gives to `sink` the parts of the map that differ from an earlier state, or all parts without one.
    /// Nodes that the two states share are skipped. A part holds 16 x 16 x 16 cells, or the larger leaves of
    /// a cube.
    ///
    /// # Errors
    ///
    /// Those of `sink`.
    pub fn save_state(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        self.tree.save(earlier.map(|earlier| &earlier.tree), sink)
    }

    /// Restores, bit by bit, the map that was saved in these parts; their order does not matter.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::State`] names a part that is damaged, missing or superfluous.
    pub fn load_state(
        config: OctreeConfig,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Self, Error> {
        config.validate()?;
        let tree = Tree::load(config.color, parts)?;
        Ok(Self::from_parts(config, tree))
    }
}

use dymlm_core::StateSink;

use crate::storage::Tree;
use crate::{Error, Octree, OctreeConfig};

impl Octree {
    /// Gives to `sink` the parts of the map that differ from those of an earlier state, all of them without
    /// one: what the two share is passed over. A part holds 16 x 16 x 16 cells, or the larger leaves of a
    /// cube.
    ///
    /// # Errors
    ///
    /// Those of `sink`.
    pub fn save_state(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        self.tree.save(earlier.map(|earlier| &earlier.tree), sink)
    }

    /// The map whose parts these are, in any order, to the bit.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::State`] names a part that is damaged, missing or too many.
    pub fn load_state(
        config: OctreeConfig,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Self, Error> {
        config.validate()?;
        let tree = Tree::load(config.color, parts)?;
        Ok(Self::from_parts(config, tree))
    }
}

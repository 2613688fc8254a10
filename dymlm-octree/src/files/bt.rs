use std::io::{BufRead, Write};
use std::path::Path;

use super::header::Header;
use super::{load, read_error, read_tree, save};
use crate::lattice::DEPTH;
use crate::occupancy_model::OccupancyModel;
use crate::storage::{Kind, NO_COLOR, Subtree, SubtreeToFill};
use crate::{Error, Octree, OctreeConfig};

const FIRST_LINE: &str = "# Octomap OcTree binary file";

/// The two bits that a node has for each child.
const FREE: u16 = 0b01;
const OCCUPIED: u16 = 0b10;
const INNER: u16 = 0b11;

/// The compact format, `.bt`: only free or occupied, two bits a node.
impl Octree {
    /// Writes the maximum-likelihood map (see [`Self::to_max_likelihood`]), as OctoMap's `writeBinary` does;
    /// this map stays as it is. The nodes are put together in memory first, since the header has their number.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_bt(&self, mut writer: impl Write) -> Result<(), Error> {
        let mut map = Self::from_parts(self.config().clone(), self.tree.clone());
        map.to_max_likelihood();
        let (mut nodes, mut size) = (Vec::new(), 0);
        if !map.is_empty() {
            // The root itself has no bits: a map that is one leaf is written as its eight children.
            size = 1 + put_children(map.tree.subtree(), &mut nodes);
        }
        let header = Header { id: "OcTree".to_owned(), size, resolution: map.resolution() };
        header.write(&mut writer, FIRST_LINE)?;
        writer.write_all(&nodes)?;
        writer.flush()?;
        Ok(())
    }

    /// Reads a map. Free and occupied leaves get the clamping bounds of `config`; the cell size comes from
    /// the file, and there are no colours. The reader is left at the first byte after the tree.
    ///
    /// Memory grows with what has been read, whatever the header promises.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] for anything that is not the tree the header promises,
    /// [`Error::UnsupportedTree`], [`Error::Config`], [`Error::Io`].
    ///
    /// ```
    /// # use dymlm_octree::{Octree, OctreeConfig};
    /// # let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0; 3], &[[1.0, 0.0, 0.0]])?;
    /// let mut file = Vec::new();
    /// map.write_bt(&mut file)?;
    /// let again = Octree::read_bt(file.as_slice(), OctreeConfig::default())?;
    /// assert_eq!(again.state([1.0, 0.0, 0.0]), map.state([1.0, 0.0, 0.0]));
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn read_bt(mut reader: impl BufRead, config: OctreeConfig) -> Result<Self, Error> {
        let header = Header::read(&mut reader, FIRST_LINE)?;
        let model = OccupancyModel::new(&config);
        read_tree(&header, config, false, |tree| {
            Ok(1 + read_children(&mut reader, &model, tree.subtree_to_fill(), 0)?)
        })
    }

    /// [`Self::write_bt`] to a file. It is written under another name in the same folder, then renamed: an
    /// older file either stays or is replaced by a complete one.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], naming the file.
    pub fn save_bt(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        save(path.as_ref(), |writer| self.write_bt(writer))
    }

    /// [`Self::read_bt`] from a file.
    ///
    /// # Errors
    ///
    /// As [`Self::read_bt`], naming the file.
    pub fn load_bt(path: impl AsRef<Path>, config: OctreeConfig) -> Result<Self, Error> {
        load(path.as_ref(), |reader| Self::read_bt(reader, config))
    }
}

/// Appends two bits for each child, children 0 to 3 in the first byte, then the children that are not leaves.
/// Returns the number of nodes below. At most 16 calls deep.
fn put_children(subtree: Subtree<'_>, out: &mut Vec<u8>) -> u64 {
    let children: [Subtree<'_>; 8] = std::array::from_fn(|i| subtree.child(i as u8));
    let kinds = children.map(Subtree::kind);
    let bits = kinds.iter().rev().fold(0, |bits, &kind| {
        bits << 2
            | match kind {
                Kind::Absent => 0,
                Kind::Leaf(log_odds) if OccupancyModel::is_occupied(log_odds) => OCCUPIED,
                Kind::Leaf(_) => FREE,
                Kind::Inner => INNER,
            }
    });
    out.extend_from_slice(&bits.to_le_bytes());
    let mut nodes = 0;
    for (child, kind) in children.into_iter().zip(kinds) {
        nodes += u64::from(kind != Kind::Absent);
        if kind == Kind::Inner {
            nodes += put_children(child, out);
        }
    }
    nodes
}

/// Reads an inner node at a depth into leaves, and counts the nodes below. At most 16 calls deep.
fn read_children(
    reader: &mut impl BufRead,
    model: &OccupancyModel,
    mut node: SubtreeToFill<'_>,
    depth: u8,
) -> Result<u64, Error> {
    let mut bytes = [0; 2];
    reader.read_exact(&mut bytes).map_err(read_error)?;
    let bits = u16::from_le_bytes(bytes);
    if bits == 0 {
        return Err(Error::Malformed(format!("an inner node without children at depth {depth}")));
    }
    let mut nodes = 0;
    let kind = |i: u8| bits >> (2 * i) & 0b11;
    for i in 0..8 {
        let log_odds = match kind(i) {
            FREE => model.min,
            OCCUPIED => model.max,
            INNER if depth + 1 == DEPTH => {
                return Err(Error::Malformed(format!("a node with children below depth {DEPTH}")));
            }
            _ => continue,
        };
        if let Some(child) = node.child(i) {
            child.fill(log_odds, NO_COLOR);
            nodes += 1;
        }
    }
    // Children that are not leaves follow their parent's bits.
    for i in (0..8).filter(|&i| kind(i) == INNER) {
        if let Some(child) = node.child(i) {
            nodes += 1 + read_children(reader, model, child, depth + 1)?;
        }
    }
    Ok(nodes)
}

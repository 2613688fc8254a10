use std::io::{BufRead, Write};
use std::path::Path;

use dymlm_core::Rgb;

use super::header::Header;
use super::{load, read_error, read_tree, save};
use crate::lattice::DEPTH;
use crate::storage::{Kind, NO_COLOR, Subtree, SubtreeToFill};
use crate::{Error, Octree, OctreeConfig};

const FIRST_LINE: &str = "# Octomap OcTree file";

/// The full format, `.ot`: every node with its log-odds and, in a `ColorOcTree`, its colour.
impl Octree {
    /// Writes the map with all its log-odds, as OctoMap's `write` does. The nodes are put together in memory first,
    /// since the header has their number.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_ot(&self, mut writer: impl Write) -> Result<(), Error> {
        let colored = self.tree.has_colors();
        let (root, mut nodes) = (self.tree.subtree(), Vec::new());
        let size = put_node(root, root.kind(), colored, &mut nodes);
        let id = if colored { "ColorOcTree" } else { "OcTree" };
        let header = Header { id: id.to_owned(), size, resolution: self.resolution() };
        header.write(&mut writer, FIRST_LINE)?;
        writer.write_all(&nodes)?;
        writer.flush()?;
        Ok(())
    }

    /// Reads a map. Cell size and colour mode come from the file, all else from `config`. The reader is left
    /// at the first byte after the tree. A tree that was written unpruned is pruned.
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
    /// map.write_ot(&mut file)?;
    /// let again = Octree::read_ot(file.as_slice(), OctreeConfig::default())?;
    /// assert!(again.leaves().eq(map.leaves()));
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn read_ot(mut reader: impl BufRead, config: OctreeConfig) -> Result<Self, Error> {
        let header = Header::read(&mut reader, FIRST_LINE)?;
        let colored = header.id == "ColorOcTree";
        read_tree(&header, config, colored, |tree| {
            read_nodes(&mut reader, colored, tree.subtree_to_fill(), 0)
        })
    }

    /// [`Self::write_ot`] to a file. It is written under another name in the same folder, then renamed: an
    /// older file either stays or is replaced by a complete one.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], naming the file.
    pub fn save_ot(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        save(path.as_ref(), |writer| self.write_ot(writer))
    }

    /// [`Self::read_ot`] from a file.
    ///
    /// # Errors
    ///
    /// As [`Self::read_ot`], naming the file.
    pub fn load_ot(path: impl AsRef<Path>, config: OctreeConfig) -> Result<Self, Error> {
        load(path.as_ref(), |reader| Self::read_ot(reader, config))
    }
}

/// Appends a node: log-odds (f32), colour (three bytes, only in a `ColorOcTree`), one bit for each child that
/// exists, then the children. Returns the number of nodes. At most 16 calls deep.
fn put_node(subtree: Subtree<'_>, kind: Kind, colored: bool, out: &mut Vec<u8>) -> u64 {
    let log_odds = match kind {
        Kind::Absent => return 0,
        Kind::Leaf(log_odds) => log_odds,
        Kind::Inner => subtree.max_log_odds().unwrap_or(0.0),
    };
    out.extend_from_slice(&log_odds.to_le_bytes());
    if colored {
        out.extend_from_slice(&subtree.color());
    }
    if kind != Kind::Inner {
        out.push(0);
        return 1;
    }
    let children: [Subtree<'_>; 8] = std::array::from_fn(|i| subtree.child(i as u8));
    let kinds = children.map(Subtree::kind);
    let exists = |i: usize| u8::from(kinds[i] != Kind::Absent) << i;
    out.push((0..8).map(exists).sum());
    1 + children.into_iter().zip(kinds).map(|(child, kind)| put_node(child, kind, colored, out)).sum::<u64>()
}

/// One node as the file has it.
struct Node {
    log_odds: f32,
    color: Rgb,
    children: u8,
}

/// Reads a tree into leaves, and counts its nodes. At most 16 calls deep.
fn read_nodes(
    reader: &mut impl BufRead,
    colored: bool,
    mut subtree: SubtreeToFill<'_>,
    before: u64,
) -> Result<u64, Error> {
    let node = read_node(reader, colored)?;
    let mut nodes = before + 1;
    if node.children == 0 {
        if !node.log_odds.is_finite() {
            let log_odds = node.log_odds;
            return Err(Error::Malformed(format!("the log-odds of its node {nodes} are {log_odds}")));
        }
        subtree.fill(node.log_odds, node.color);
        return Ok(nodes);
    }
    for i in (0..8).filter(|i| node.children >> i & 1 != 0) {
        let Some(child) = subtree.child(i) else {
            return Err(Error::Malformed(format!("its node {nodes} has children below depth {DEPTH}")));
        };
        nodes = read_nodes(reader, colored, child, nodes)?;
    }
    Ok(nodes)
}

fn read_node(reader: &mut impl BufRead, colored: bool) -> Result<Node, Error> {
    let mut bytes = [0; 8];
    let bytes = &mut bytes[..if colored { 8 } else { 5 }];
    reader.read_exact(bytes).map_err(read_error)?;
    let log_odds = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let (color, children) =
        if colored { ([bytes[4], bytes[5], bytes[6]], bytes[7]) } else { (NO_COLOR, bytes[4]) };
    Ok(Node { log_odds, color, children })
}

use dymlm_geometry::OrientedBox;

/// A labelled thing of the true world that does not move.
///
/// For things measured by hand, use [`new`](Self::new); `dymlm_sim::Truth` has the things of its sequences.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrueObject {
    /// Unique id of the thing.
    pub id: usize,
    /// COCO label.
    pub label: String,
    /// The smallest box around all parts of the thing, along the thing's own axes, in the world. Its z axis
    /// is the scene's vertical.
    pub oriented_box: OrientedBox,
    /// The rotations about the vertical that leave its box or shape unchanged.
    pub symmetry: YawSymmetry,
    /// Number of frames that saw it: with enough of its pixels having a reading, within range, and no mover
    /// in the way.
    pub frames_visible: u32,
    /// Share of its surface that was seen, 0..=1; the underside on which it stands counts as surface.
    pub visible_share: f64,
}

/// The rotations about the vertical that leave a thing unchanged. Boxes have no front, so half a turn is
/// always one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum YawSymmetry {
    /// Half a turn: for a box that is longer than wide.
    HalfTurn,
    /// A quarter turn: for a square footprint, with sides within 10 % of each other.
    QuarterTurn,
    /// Any rotation: at least 80 % of the volume is in bodies that are round about one upright axis. A cup is
    /// round despite its handle.
    Full,
}

impl TrueObject {
    /// A thing that was completely visible in `frames_visible` frames and is not round; its box's z axis is
    /// the vertical.
    pub fn new(id: usize, label: &str, oriented_box: OrientedBox, frames_visible: u32) -> Self {
        let [length, width, _] = oriented_box.lengths();
        let symmetry =
            if is_square(length, width) { YawSymmetry::QuarterTurn } else { YawSymmetry::HalfTurn };
        Self { id, label: label.to_owned(), oriented_box, symmetry, frames_visible, visible_share: 1.0 }
    }
}

/// Whether two sides of a footprint are within 10 % of each other.
fn is_square(length: f64, width: f64) -> bool {
    (length - width).abs() <= 0.1 * length.max(width)
}

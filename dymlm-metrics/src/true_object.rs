use dymlm_geometry::OrientedBox;

/// A labelled thing of the true world that stays where it is.
///
/// For things measured by hand, use [`new`](Self::new); `dymlm_sim::Truth` has those of its sequences.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrueObject {
    /// Tells things apart.
    pub id: usize,
    /// COCO label.
    pub label: String,
    /// The smallest box around all parts of the thing along its own axes, in the world. Its z axis is the
    /// scene's vertical.
    pub oriented_box: OrientedBox,
    /// How far it can be turned about the vertical before its box or its shape tells.
    pub symmetry: YawSymmetry,
    /// Number of frames that saw it: enough pixels of it with a reading, within range, no mover in the way.
    pub frames_visible: u32,
    /// Share of its surface that was seen, 0..=1; the underside, where it stands, counts as surface.
    pub visible_share: f64,
}

/// By which turns about the vertical a thing is indistinguishable. Boxes have no front, so that every thing's
/// is half a turn at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum YawSymmetry {
    /// Half a turn: a box longer than wide.
    HalfTurn,
    /// A quarter turn: a square footprint, its sides within 10 % of each other.
    QuarterTurn,
    /// Any turn: bodies that are round about one upright axis make up 80 % of the volume. A cup is round, its
    /// handle notwithstanding.
    Full,
}

impl TrueObject {
    /// A thing that was wholly visible in `frames_visible` frames, not round; its box's z axis is the
    /// vertical.
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

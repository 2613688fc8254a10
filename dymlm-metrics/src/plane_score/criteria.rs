//! What counts as the same plane: the numbers of the score.

/// Visible area of a face (with its reliefs) from which on a map is asked for it, square metres: 3000 pixels
/// of a 640x480 Kinect at 2.7 m, the support that plane extraction wants.
pub(super) const MIN_AREA: f64 = 0.08;
/// Visible area counts towards [`MIN_AREA`] where a square of this side around it is seen, metres: no plane
/// can be fitted to the edge of a board.
pub(super) const MIN_WIDTH: f64 = 0.1;
/// Share of such a square that must be seen for its seen cells to count.
pub(super) const SEEN_SHARE: f64 = 0.75;
/// Side of the cells that planes are divided into, metres.
pub(super) const CELL: f64 = 0.02;
/// Farthest that a plane may lie from a face that it stands for, metres: the distance at which planes are
/// associated.
pub(super) const MAX_OFFSET: f64 = 0.05;
/// Cosine of the largest angle between a plane and a face that it stands for, 10 degrees: the angle at which
/// planes are associated.
pub(super) const LEAST_COSINE: f64 = 0.984_807_753_012_208;
/// A plane that faces the wrong way is taken to be this much further from a face than it is, metres: of the
/// two sides of a board, the one whose normal it has, unless it lies on the other.
pub(super) const WRONG_WAY: f64 = 0.02;
/// Share of a face's visible area that the planes matching it must cover for it to count as found.
pub(super) const MIN_COVERAGE: f64 = 0.25;
/// Share of a plane's area from which on a face is a substantial part of it; [`MIN_AREA`] is substantial in
/// any case.
pub(super) const MERGED_SHARE: f64 = 0.2;
/// Share of the smaller plane that two planes on one face with reliefs must share to be duplicates.
pub(super) const SAME_AREA: f64 = 0.2;
/// Share of a plane on one member of a face with reliefs from which on it is that member's plane.
pub(super) const ONE_MEMBER: f64 = 0.8;

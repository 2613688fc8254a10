//! The thresholds of the score.

/// Least visible area of a face (with its reliefs) for which a map is asked for it, square metres: 3000
/// pixels of a 640x480 Kinect at 2.7 m, the support that plane extraction needs.
pub(super) const MIN_AREA: f64 = 0.08;
/// Visible area only counts towards [`MIN_AREA`] where a whole square of this side is seen, metres: no plane
/// can be fitted to the edge of a board. An unseen strip of this width parts a face into visible pieces.
pub(super) const MIN_WIDTH: f64 = 0.1;
/// Cosine of the largest angle between a plane and a face that it matches, 10 degrees: the angle at which
/// planes are associated.
pub(super) const LEAST_COSINE: f64 = 0.984_807_753_012_208;
/// Share of a face's visible area that its matching planes must cover for the face to be found.
pub(super) const MIN_COVERAGE: f64 = 0.25;

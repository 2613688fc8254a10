use std::f64::consts::TAU;

use dymlm_core::vector3::{along, cross, difference, dot};
use parry3d::math::Vec3;

use crate::scene::{Part, Shape};
use crate::to_pose::to_pose;

/// A flat side of a body: a side of a cuboid, a wall of a room, a cap of a cylinder.
#[derive(Debug, Clone)]
pub(super) struct FlatSide {
    /// Index of the body.
    pub(super) part: usize,
    /// Number of the body's side, see [`side_number`].
    pub(super) side: usize,
    /// Unit normal in the scene's frame: out of a body, into a room.
    pub(super) normal: [f64; 3],
    /// Direction of one of the polygon's edges, unit length.
    pub(super) along_u: [f64; 3],
    /// Convex polygon in the scene, counterclockwise about the normal.
    pub(super) corners: Vec<[f64; 3]>,
}

/// Number of sides that a body can have: one for each half axis of its frame.
pub(super) const SIDES: usize = 6;
/// Corners of the polygon that represents a disc.
const DISC_CORNERS: u8 = 48;

/// The number of the side with the given normal in the body's frame; `None` where the surface is curved.
#[inline]
pub(super) fn side_number(shape: &Shape, normal: Vec3) -> Option<usize> {
    let axis = match shape {
        Shape::Cuboid(_) | Shape::Interior(_) => normal.to_array().iter().position(|c| c.abs() > 0.5)?,
        Shape::Cylinder(_) if normal.y.abs() > 0.5 => 1,
        Shape::Cylinder(_) | Shape::Ellipsoid(_) | Shape::Capsule(_) => return None,
    };
    Some(2 * axis + usize::from(normal.to_array()[axis] > 0.0))
}

/// All flat sides of a body.
pub(super) fn flat_sides(part: &Part, index: usize) -> impl Iterator<Item = FlatSide> {
    let scene_from_part = to_pose(&part.scene_from_part);
    let half = part.shape.half_extents().to_array().map(f64::from);
    let shape = part.shape;
    (0..SIDES).filter_map(move |side| {
        let (axis, positive) = (side / 2, side % 2 == 1);
        let outwards = if positive { 1.0 } else { -1.0 };
        // A room is seen from inside: the side with the normal +x is at -x.
        let place = if matches!(shape, Shape::Interior(_)) { -outwards } else { outwards };
        let unit = |axis: usize| std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        let normal = unit(axis).map(|c: f64| c * outwards);
        let u = unit((axis + 1) % 3);
        let v = cross(normal, u);
        let center = along([0.0; 3], place * half[axis], unit(axis));
        let (half_u, half_v) = (half[(axis + 1) % 3], half[(axis + 2) % 3]);
        let corners = match shape {
            Shape::Cuboid(_) | Shape::Interior(_) => rectangle(center, u, v, half_u, half_v),
            Shape::Cylinder(_) if axis == 1 => disc(center, u, v, half_u),
            Shape::Cylinder(_) | Shape::Ellipsoid(_) | Shape::Capsule(_) => return None,
        };
        Some(FlatSide {
            part: index,
            side,
            normal: scene_from_part.rotate(normal),
            along_u: scene_from_part.rotate(u),
            corners: corners.into_iter().map(|corner| scene_from_part.transform_point(corner)).collect(),
        })
    })
}

fn rectangle(center: [f64; 3], u: [f64; 3], v: [f64; 3], half_u: f64, half_v: f64) -> Vec<[f64; 3]> {
    let corner = |su: f64, sv: f64| along(along(center, su * half_u, u), sv * half_v, v);
    vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
}

/// A regular polygon with the disc's area.
fn disc(center: [f64; 3], u: [f64; 3], v: [f64; 3], radius: f64) -> Vec<[f64; 3]> {
    let step = TAU / f64::from(DISC_CORNERS);
    let radius = radius * (step / step.sin()).sqrt();
    (0..DISC_CORNERS)
        .map(|k| {
            let (sin, cos) = (step * f64::from(k)).sin_cos();
            along(along(center, radius * cos, u), radius * sin, v)
        })
        .collect()
}

/// Lowest and highest coordinates of some points.
pub(super) fn bounds_of<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> [[f64; 3]; 2] {
    points.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], point| {
        let fold =
            |side: [f64; 3], pick: fn(f64, f64) -> f64| std::array::from_fn(|k| pick(side[k], point[k]));
        [fold(low, f64::min), fold(high, f64::max)]
    })
}

impl FlatSide {
    pub(super) fn bounds(&self) -> [[f64; 3]; 2] {
        bounds_of(self.corners.iter())
    }

    /// Signed distance of a point from the side's plane, metres, positive on the side of the normal.
    pub(super) fn distance(&self, point: [f64; 3]) -> f64 {
        dot(self.normal, difference(point, self.corners[0]))
    }

    /// Twice the area: enough to compare two sides.
    pub(super) fn doubled_area(&self) -> f64 {
        let first = self.corners[0];
        let triangles = self.corners.windows(2);
        triangles
            .map(|pair| dot(self.normal, cross(difference(pair[0], first), difference(pair[1], first))))
            .sum()
    }

    /// Whether two sides are on one plane, face the same way and touch.
    pub(super) fn continues(&self, other: &Self) -> bool {
        dot(self.normal, other.normal) > 0.99
            && other.corners.iter().all(|&corner| self.distance(corner).abs() <= COPLANAR)
            && self.corners.iter().all(|&corner| other.distance(corner).abs() <= COPLANAR)
            && self.gap_to(other) <= TOUCHING
            && other.gap_to(self) <= TOUCHING
    }

    /// Largest distance of the other polygon beyond one of this side's edges; negative when no edge separates
    /// the two.
    fn gap_to(&self, other: &Self) -> f64 {
        let next = self.corners.iter().cycle().skip(1);
        let edges = self.corners.iter().zip(next);
        let gap = |(&from, &to): (&[f64; 3], &[f64; 3])| {
            let edge = difference(to, from);
            let outwards = cross(edge, self.normal);
            let length = dot(outwards, outwards).sqrt();
            let nearest = other.corners.iter().map(|&corner| dot(outwards, difference(corner, from)));
            nearest.fold(f64::INFINITY, f64::min) / length
        };
        edges.map(gap).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Two sides are on one plane if they are at most this far from each other's planes, metres: a tenth of a
/// Kinect's noise at 2.5 m.
const COPLANAR: f64 = 0.002;
/// Two sides touch if they are at most this far apart in their plane, metres: a pixel at 4 m is 0.8 cm wide.
const TOUCHING: f64 = 0.015;

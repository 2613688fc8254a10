use dymlm_core::vector3::{cross, dot};

/// One connected piece of a plane's boundary: an outline and the holes in it. World frame, metres.
///
/// Rings are closed without repeating their first corner. Seen from the side to which the plane's normal
/// points, outlines run counterclockwise and holes clockwise.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct BoundaryPolygon {
    /// The outer ring.
    pub outline: Vec<[f64; 3]>,
    /// The holes' rings.
    pub holes: Vec<Vec<[f64; 3]>>,
}

impl BoundaryPolygon {
    /// Area of the outline minus the area of its holes, square metres.
    pub fn area(&self) -> f64 {
        let of_holes: f64 = self.holes.iter().map(|hole| ring_area(hole)).sum();
        ring_area(&self.outline) - of_holes
    }
}

/// Half the length of the sum of the cross products of consecutive corners.
fn ring_area(ring: &[[f64; 3]]) -> f64 {
    let Some(&origin) = ring.first() else { return 0.0 };
    let from_origin =
        |corner: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| corner[axis] - origin[axis]) };
    let mut sum = [0.0; 3];
    for pair in ring.windows(2) {
        let product = cross(from_origin(pair[0]), from_origin(pair[1]));
        for axis in 0..3 {
            sum[axis] += product[axis];
        }
    }
    0.5 * dot(sum, sum).sqrt()
}

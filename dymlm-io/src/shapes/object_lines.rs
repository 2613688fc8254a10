/// Number of points of a drawn circle.
const SEGMENTS: usize = 48;

/// The corners of a box of side 1 around the origin, and its edges as pairs of corner indices.
pub(crate) fn box_edges() -> ([[f64; 3]; 8], [[u32; 2]; 12]) {
    let side = |corner: u32, axis: u32| if corner >> axis & 1 == 1 { 0.5 } else { -0.5 };
    let corners = std::array::from_fn(|corner| std::array::from_fn(|axis| side(corner as u32, axis as u32)));
    // Four edges along each axis, from the corners on its low side.
    let edges = std::array::from_fn(|edge| {
        let (axis, rest) = (edge as u32 / 4, edge as u32 % 4);
        let low = (rest & ((1 << axis) - 1)) | (rest >> axis << (axis + 1));
        [low, low | 1 << axis]
    });
    (corners, edges)
}

/// The circles in which a ball of diameter 1 around the origin meets the coordinate planes.
pub(crate) fn unit_circles() -> [[[f64; 3]; SEGMENTS]; 3] {
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / SEGMENTS as f64;
    std::array::from_fn(|axis| {
        std::array::from_fn(|i| {
            let (sin, cos) = angle(i).sin_cos();
            let mut point = [0.0, 0.5 * cos, 0.5 * sin];
            point.rotate_right(axis);
            point
        })
    })
}

/// The faces of the box of [`box_edges`]: three corners per triangle, counterclockwise seen from outside.
#[cfg(feature = "gltf")]
pub(crate) const BOX_TRIANGLES: [[u32; 3]; 12] = [
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_twelve_different_edges_of_length_one() {
        let (corners, mut edges) = box_edges();
        for [a, b] in edges {
            let apart = (0..3).map(|k| (corners[a as usize][k] - corners[b as usize][k]).abs());
            assert_eq!(apart.sum::<f64>(), 1.0);
        }
        edges.sort_unstable();
        assert!(edges.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn each_circle_is_across_an_axis() {
        for (axis, circle) in unit_circles().iter().enumerate() {
            for point in circle {
                assert_eq!(point[axis], 0.0);
                assert!((point.iter().map(|c| c * c).sum::<f64>() - 0.25).abs() < 1e-12);
            }
        }
    }

    #[cfg(feature = "gltf")]
    #[test]
    fn the_faces_of_a_box_enclose_it() {
        use dymlm_core::vector3::{cross, difference, dot};

        let corners = box_edges().0;
        let volume = BOX_TRIANGLES.map(|triangle| {
            let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            assert!(dot(cross(difference(b, a), difference(c, a)), a) > 0.0);
            dot(a, cross(b, c)) / 6.0
        });
        assert!((volume.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}

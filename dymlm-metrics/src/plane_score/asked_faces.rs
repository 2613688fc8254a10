use super::criteria::{MIN_AREA, MIN_WIDTH};
use crate::TrueFace;

/// A face with its reliefs, as a map is asked for them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AskedFace {
    /// Id of the face that the reliefs lie on.
    pub(super) id: usize,
    /// Indices of the face itself and of its large reliefs.
    pub(super) wanted: Vec<usize>,
    /// Indices of the small reliefs, which a map may contain or leave out.
    pub(super) optional: Vec<usize>,
    /// Visible area of the faces in `wanted`, square metres.
    pub(super) visible_area: f64,
}

/// The faces that are large enough to be asked for, by ascending id.
pub(super) fn asked_faces(faces: &[TrueFace]) -> Vec<AskedFace> {
    let mut by_relief: Vec<usize> = (0..faces.len()).collect();
    by_relief.sort_by_key(|&index| faces[index].relief);
    let groups = by_relief.chunk_by(|&a, &b| faces[a].relief == faces[b].relief);
    let asked = groups.filter_map(|group| {
        let (id, members) = (faces[group[0]].relief, group.iter().copied());
        let (wanted, optional): (Vec<usize>, Vec<usize>) =
            members.partition(|&member| faces[member].id == id || faces[member].visible_area >= MIN_AREA);
        let visible_area: f64 = wanted.iter().map(|&member| faces[member].visible_area).sum();
        let wide_area = || wanted.iter().map(|&member| wide_area(&faces[member], MIN_WIDTH)).sum::<f64>();
        // The cheaper test first.
        let large = visible_area >= MIN_AREA && wide_area() >= MIN_AREA;
        (large && visible_area > 0.0).then_some(AskedFace { id, wanted, optional, visible_area })
    });
    asked.collect()
}

/// Area of all squares of side `width` whose cells are all seen. O(cells x cells of a square).
fn wide_area(face: &TrueFace, width: f64) -> f64 {
    let raster = &face.cells.raster;
    let (columns, rows) = (raster.columns(), raster.rows());
    let [across, up] = raster.cell().map(|cell| (width / cell).round().max(1.0) as usize);
    let seen = &face.cells.seen;
    let mut wide = vec![false; seen.len()];
    for row in 0..(rows + 1).saturating_sub(up) {
        for column in 0..(columns + 1).saturating_sub(across) {
            let strips = (row..row + up).map(|row| row * columns + column..row * columns + column + across);
            if strips.clone().all(|strip| !seen[strip].contains(&false)) {
                strips.for_each(|strip| wide[strip].fill(true));
            }
        }
    }
    face.cells.area_of(&wide)
}

#[cfg(test)]
mod tests {
    use dymlm_core::Plane;

    use super::*;

    fn rectangle(length: f64, width: f64) -> TrueFace {
        let outline = vec![[0.0; 3], [length, 0.0, 0.0], [length, width, 0.0], [0.0, width, 0.0]];
        TrueFace::new(0, Plane::new([0.0, 0.0, 1.0], 0.0).unwrap(), vec![outline], 0.02).unwrap()
    }

    #[test]
    fn strips_are_not_asked_for() {
        let is_asked = |face: TrueFace| !asked_faces(&[face]).is_empty();
        assert!(
            is_asked(rectangle(0.4, 0.2)) && is_asked(rectangle(1.0, 0.1)) && !is_asked(rectangle(0.38, 0.2))
        );
        assert!(!is_asked(rectangle(3.0, 0.06)));
    }

    #[test]
    fn wide_area_is_what_squares_cover() {
        assert!((wide_area(&rectangle(0.4, 0.2), 0.1) - 0.08).abs() < 1e-9);
        // A strip of 4 cm along a square of 40 cm does not count.
        let mut face = rectangle(1.0, 0.4);
        for (cell, seen) in face.cells.seen.iter_mut().enumerate() {
            *seen = cell % 50 < 20 || cell / 50 < 2;
        }
        let wide = wide_area(&face, 0.1);
        assert!((wide - 0.16).abs() < 1e-9, "{wide}");
    }
}

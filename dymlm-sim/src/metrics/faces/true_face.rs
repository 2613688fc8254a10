use dymlm_core::Plane;
use dymlm_core::vector3::difference;

use super::cell_raster::CellRaster;

/// A finite plane face of the true world: one flat side of things, as large as it is, and which part of it was seen.
///
/// [`Truth::faces`](crate::Truth::faces) gives those of a sequence. For a recording whose faces were measured by hand,
/// make them with [`new`](Self::new).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TrueFace {
    /// Tells faces apart.
    pub id: usize,
    /// The face that this one is no more than 3 cm in front of (or behind), within its outline: a keyboard's and a
    /// paper's face on a desk, drawers before a cabinet. Its own `id` for all others. Such faces are asked
    /// for together, since a depth camera can hardly tell them apart.
    pub relief: usize,
    /// COCO label of the thing whose face it is.
    pub label: Option<&'static str>,
    /// The face in the world; the normal points outwards, to where it can be seen from.
    pub plane: Plane,
    /// Polygons in the world, counterclockwise about the normal, one a flat piece that the face is made of; the pieces
    /// touch or overlap. Discs are polygons of 48 corners.
    pub outline: Vec<Vec<[f64; 3]>>,
    /// Area within the outline, square metres, seen or not; to a cell of the raster.
    pub area: f64,
    /// Area that was seen, square metres: by enough frames, within range, not too steeply.
    pub visible_area: f64,
    pub(in crate::metrics) cells: FaceCells,
}

/// A face divided into cells.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::metrics) struct FaceCells {
    pub(in crate::metrics) raster: CellRaster,
    /// Whether the middle lies within the outline.
    pub(in crate::metrics) inside: Vec<bool>,
    /// Whether it was seen well enough to be asked for; only cells inside are.
    pub(in crate::metrics) seen: Vec<bool>,
    /// Whether there is any reading of it, at whatever angle and distance; only cells inside have one.
    pub(in crate::metrics) read: Vec<bool>,
}

impl TrueFace {
    /// A face that was seen as a whole, from polygons on a plane and in cells of about `cell` metres. `None` when the
    /// polygons enclose no cell.
    ///
    /// ```
    /// use dymlm_core::Plane;
    /// use dymlm_sim::TrueFace;
    ///
    /// let outline = vec![[0.0, 0.0, 0.7], [1.2, 0.0, 0.7], [1.2, 0.6, 0.7], [0.0, 0.6, 0.7]];
    /// let table = TrueFace::new(0, Plane::new([0.0, 0.0, 1.0], -0.7)?, vec![outline], 0.02).ok_or("no area")?;
    /// assert!((table.visible_area - 0.72).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(id: usize, plane: Plane, outline: Vec<Vec<[f64; 3]>>, cell: f64) -> Option<Self> {
        let raster = raster_over(&outline, plane.normal(), cell)?;
        let inside = fill_pieces(&raster, &outline);
        let cells = FaceCells { seen: inside.clone(), read: inside.clone(), inside, raster };
        let area = cells.area_of(&cells.inside);
        (area > 0.0).then_some(Self {
            id,
            relief: id,
            label: None,
            plane,
            outline,
            area,
            visible_area: area,
            cells,
        })
    }

    /// The seen part as polygons in the world: outer rings counterclockwise about the normal, holes clockwise, along the
    /// sides of the cells.
    pub fn visible_boundary(&self) -> Vec<Vec<[f64; 3]>> {
        super::rings::rings_around(&self.cells.raster, &self.cells.seen)
    }
}

impl FaceCells {
    /// Area of the marked cells, square metres.
    pub(in crate::metrics) fn area_of(&self, marked: &[bool]) -> f64 {
        marked.iter().filter(|&&marked| marked).count() as f64 * self.raster.cell_area()
    }
}

/// A raster over polygons on a plane, along the longest side of the first.
pub(in crate::metrics) fn raster_over(
    rings: &[Vec<[f64; 3]>],
    normal: [f64; 3],
    cell: f64,
) -> Option<CellRaster> {
    let finite = || rings.iter().flatten().copied().filter(|point| point.iter().all(|c| c.is_finite()));
    let longest = rings.iter().find_map(|ring| longest_side(ring))?;
    CellRaster::around(finite(), normal, longest, cell)
}

fn longest_side(ring: &[[f64; 3]]) -> Option<[f64; 3]> {
    let next = ring.iter().cycle().skip(1);
    let sides = ring.iter().zip(next).map(|(&from, &to)| difference(to, from));
    let squared = |side: &[f64; 3]| side.iter().map(|c| c * c).sum::<f64>();
    sides
        .filter(|side| squared(side).is_finite() && squared(side) > 0.0)
        .max_by(|a, b| squared(a).total_cmp(&squared(b)))
}

/// The cells within at least one of the pieces.
pub(super) fn fill_pieces(raster: &CellRaster, pieces: &[Vec<[f64; 3]>]) -> Vec<bool> {
    let mut inside = vec![false; raster.len()];
    for piece in pieces {
        let filled = raster.fill(std::slice::from_ref(piece));
        inside.iter_mut().zip(filled).for_each(|(inside, filled)| *inside |= filled);
    }
    inside
}

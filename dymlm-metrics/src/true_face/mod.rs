//! The flat faces of the true world.

mod cell_raster;
mod rings;
mod visible_pieces;

pub use cell_raster::CellRaster;
use dymlm_core::Plane;
use dymlm_core::vector3::difference;
use rings::rings_around;

/// A finite plane face of the true world: one flat side of things with its full extent, and the part of it
/// that was seen.
///
/// For faces measured by hand, use [`new`](Self::new), or [`from_cells`](Self::from_cells) when it is known
/// which parts were seen. `dymlm_sim::Truth` has the faces of its sequences.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrueFace {
    /// Unique id of the face.
    pub id: usize,
    /// Id of the face that this one lies on, at most 3 cm in front of (or behind) it and within its outline:
    /// keyboards and papers on a desk, drawers on a cabinet. For all other faces, their own `id`. A face and
    /// its reliefs are asked for together, since a depth camera can hardly distinguish them.
    pub relief: usize,
    /// COCO label of the thing that the face belongs to.
    pub label: Option<String>,
    /// Plane of the face in the world; its normal points outwards, to the side from which the face can be
    /// seen.
    pub plane: Plane,
    /// Polygons in the world, counterclockwise about the normal, one for each flat piece of the face; the
    /// pieces touch or overlap. Discs are polygons of 48 corners.
    pub outline: Vec<Vec<[f64; 3]>>,
    /// Area within the outline, square metres, seen or not; counted in cells of the raster.
    pub area: f64,
    /// Area that was seen, square metres: by enough frames, within range, and not too obliquely.
    pub visible_area: f64,
    pub(crate) cells: FaceCells,
}

/// A face divided into cells; the three lists have one entry per cell of the raster, row by row.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FaceCells {
    /// The cells.
    pub raster: CellRaster,
    /// Whether the middle lies within the outline.
    pub inside: Vec<bool>,
    /// Whether the cell was seen well enough to be asked for; only cells inside are.
    pub seen: Vec<bool>,
    /// Whether the cell has any reading, at whatever angle and distance; only cells inside have one.
    pub read: Vec<bool>,
}

impl TrueFace {
    /// A face that was seen completely, from polygons on a plane and in cells of about `cell` metres. `None`
    /// when the polygons contain no cell.
    ///
    /// ```
    /// use dymlm_core::Plane;
    /// use dymlm_metrics::TrueFace;
    ///
    /// let outline = vec![[0.0, 0.0, 0.7], [1.2, 0.0, 0.7], [1.2, 0.6, 0.7], [0.0, 0.6, 0.7]];
    /// let table = TrueFace::new(0, Plane::new([0.0, 0.0, 1.0], -0.7)?, vec![outline], 0.02).ok_or("no area")?;
    /// assert!((table.visible_area - 0.72).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(id: usize, plane: Plane, outline: Vec<Vec<[f64; 3]>>, cell: f64) -> Option<Self> {
        let raster = raster_over(&outline, plane.normal(), cell)?;
        let inside = raster.fill_any(&outline);
        let cells = FaceCells { seen: inside.clone(), read: inside.clone(), inside, raster };
        Self::from_cells(id, plane, outline, cells).filter(|face| face.area > 0.0)
    }

    /// A face with known seen cells, without a label and not a relief of another face. `None` when a list
    /// of the cells has not one entry for each cell of the raster.
    pub fn from_cells(
        id: usize,
        plane: Plane,
        outline: Vec<Vec<[f64; 3]>>,
        cells: FaceCells,
    ) -> Option<Self> {
        let lists = [&cells.inside, &cells.seen, &cells.read];
        if lists.iter().any(|list| list.len() != cells.raster.len()) {
            return None;
        }
        let (area, visible_area) = (cells.area_of(&cells.inside), cells.area_of(&cells.seen));
        Some(Self { id, relief: id, label: None, plane, outline, area, visible_area, cells })
    }

    /// The cells, and which of them were seen.
    pub fn cells(&self) -> &FaceCells {
        &self.cells
    }

    /// The seen part as polygons in the world, along the sides of the cells: outer rings counterclockwise
    /// about the normal, holes clockwise.
    pub fn visible_boundary(&self) -> Vec<Vec<[f64; 3]>> {
        rings_around(&self.cells.raster, &self.cells.seen)
    }
}

impl FaceCells {
    /// Area of the marked cells, square metres.
    pub(crate) fn area_of(&self, marked: &[bool]) -> f64 {
        marked.iter().filter(|&&marked| marked).count() as f64 * self.raster.cell_area()
    }
}

/// A raster over polygons on a plane, aligned with the longest side of the first polygon.
pub(crate) fn raster_over(rings: &[Vec<[f64; 3]>], normal: [f64; 3], cell: f64) -> Option<CellRaster> {
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

use super::raster::Raster;
use super::{PlanCell, PlanError, PlanGrid};

/// A component that is no longer than this many cells in either direction is a speck, such as a single beam
/// of a laser leaves: nothing narrower than this has a face whose direction the grid tells.
const SPECK: i64 = 2;

/// The cells that are solid: what is occupied, but for specks, and what walls enclose. Free cells that do not
/// hang together with the largest free region are solid, since nobody gets there; so are unknown cells that
/// are surrounded, since they are the inside of a thing whose outline was seen.
pub(super) fn solid_cells(grid: &PlanGrid) -> Result<Raster, PlanError> {
    let cells_that = |is: PlanCell| Raster::of(&grid.cells, grid.width, move |&cell| cell == is);
    let free = cells_that(PlanCell::Free);
    let inside = free.largest_component().ok_or(PlanError::NothingFree)?;
    let unknown = cells_that(PlanCell::Unknown);
    let outside = unknown.components(false).into_iter();
    let outside = outside.filter(|component| component.iter().any(|&cell| unknown.is_at_border(cell)));
    let mut solid = Raster::of(&grid.cells, grid.width, |_| true);
    for cell in inside.into_iter().chain(outside.flatten()) {
        solid.cells[cell] = false;
    }
    let mut walls = 0;
    for component in solid.components(true) {
        if is_speck(&solid, &component) {
            for cell in component {
                solid.cells[cell] = false;
            }
        } else {
            walls += component.iter().filter(|&&cell| grid.cells[cell] == PlanCell::Occupied).count();
        }
    }
    if walls > 0 { Ok(solid) } else { Err(PlanError::NoWalls) }
}

fn is_speck(raster: &Raster, component: &[usize]) -> bool {
    let places = component.iter().map(|&cell| raster.place(cell));
    let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
    for place in places {
        low = [low[0].min(place[0]), low[1].min(place[1])];
        high = [high[0].max(place[0]), high[1].max(place[1])];
    }
    (0..2).all(|axis| high[axis] - low[axis] < SPECK)
}

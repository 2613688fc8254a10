use std::collections::BTreeMap;

use dymlm_core::vector3::{Vector3, bounds, norm};
use dymlm_core::{Birth, PinholeCamera, Pose};

use super::{MapObject, ObjectMap};

/// Spatial index of objects: a uniform grid over the world. Each object is in all cells that its bounding
/// ball reaches.
///
/// The cost of a query depends on the objects near, not on their total number.
#[derive(Debug, Clone)]
pub(crate) struct SpaceIndex {
    /// Side of a cell, metres.
    cell: f64,
    cells: BTreeMap<Cell, Vec<Birth>>,
    /// The first and last cell of each object.
    spans: BTreeMap<Birth, [Cell; 2]>,
}

type Cell = [i32; 3];

impl SpaceIndex {
    /// An index for queries about regions of about `range` metres.
    pub(crate) fn new(range: f64) -> Self {
        // Half of the range, so that a query for what a camera sees visits a few dozen cells at any range.
        Self { cell: 0.5 * range, cells: BTreeMap::new(), spans: BTreeMap::new() }
    }

    /// Inserts an object, or updates its place.
    pub(crate) fn place(&mut self, object: &MapObject) {
        let Ball { center, radius } = Ball::around(object);
        let span = self.span([center.map(|c| c - radius), center.map(|c| c + radius)]);
        if self.spans.get(&object.birth) == Some(&span) {
            return;
        }
        self.remove(object.birth);
        for cell in cells_of(span) {
            self.cells.entry(cell).or_default().push(object.birth);
        }
        self.spans.insert(object.birth, span);
    }

    /// Forgets an object.
    pub(crate) fn remove(&mut self, birth: Birth) {
        for cell in self.spans.remove(&birth).into_iter().flat_map(cells_of) {
            if let Some(own) = self.cells.get_mut(&cell) {
                own.retain(|other| *other != birth);
                if own.is_empty() {
                    self.cells.remove(&cell);
                }
            }
        }
    }

    /// The objects, the oldest first, that may reach into a region (lowest and highest corner).
    pub(crate) fn within(&self, region: [Vector3; 2], found: &mut Vec<Birth>) {
        let [low, high] = self.span(region);
        found.clear();
        let side = |axis: usize| (i64::from(high[axis]) - i64::from(low[axis]) + 1).max(0);
        if side(0).saturating_mul(side(1)) > self.spans.len() as i64 {
            // The region has more columns of cells than there are objects.
            let reaches_in = |span: &[Cell; 2]| (0..3).all(|a| span[0][a] <= high[a] && span[1][a] >= low[a]);
            found.extend(self.spans.iter().filter(|(_, span)| reaches_in(span)).map(|(birth, _)| *birth));
            return;
        }
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                let column = self.cells.range([x, y, low[2]]..=[x, y, high[2]]);
                found.extend(column.flat_map(|(_, own)| own));
            }
        }
        found.sort_unstable();
        found.dedup();
    }

    /// The objects, the oldest first, that a camera may see up to a depth, occluded or not.
    pub(crate) fn in_view(
        &self,
        map: &ObjectMap,
        camera: &PinholeCamera,
        world_from_camera: &Pose,
        max_depth: f64,
        found: &mut Vec<Birth>,
    ) {
        let [width, height] = [camera.width(), camera.height()].map(|side| side as f64 - 0.5);
        let [first, last] = [[-0.5, -0.5], [width, height]].map(|pixel| camera.back_project(pixel, 1.0));
        // Where an axis of the image is flipped, its first pixels are on the other side.
        let [left, right] = [first[0].min(last[0]), first[0].max(last[0])];
        let [top, bottom] = [first[1].min(last[1]), first[1].max(last[1])];
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
            .map(|(x, y)| world_from_camera.transform_point([x, y, 1.0].map(|c| c * max_depth)));
        self.within(bounds(corners.into_iter().chain([world_from_camera.translation()])), found);
        let camera_from_world = world_from_camera.inverse();
        let sides = [[-1.0, 0.0, left], [1.0, 0.0, -right], [0.0, -1.0, top], [0.0, 1.0, -bottom]];
        let is_seen = |object: &MapObject| {
            let Ball { center, radius } = Ball::around(object);
            let [x, y, z] = camera_from_world.transform_point(center);
            let is_within =
                |[a, b, c]: [f64; 3]| a * x + b * y + c * z <= radius * (a * a + b * b + c * c).sqrt();
            -radius <= z && z <= max_depth + radius && sides.into_iter().all(is_within)
        };
        found.retain(|&birth| map.born(birth).is_some_and(is_seen));
    }

    fn span(&self, [low, high]: [Vector3; 2]) -> [Cell; 2] {
        [low, high].map(|corner| corner.map(|c| (c / self.cell).floor() as i32))
    }
}

/// A bounding ball of an object and its points.
struct Ball {
    center: Vector3,
    radius: f64,
}

impl Ball {
    fn around(object: &MapObject) -> Self {
        let half_diagonal = 0.5 * norm(object.oriented_box.lengths());
        Self { center: object.oriented_box.center(), radius: super::GROWTH * half_diagonal }
    }
}

fn cells_of([low, high]: [Cell; 2]) -> impl Iterator<Item = Cell> {
    (low[0]..=high[0])
        .flat_map(move |x| (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z])))
}

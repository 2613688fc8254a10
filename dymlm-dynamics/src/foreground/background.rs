use dymlm_core::vector3::{Vector3, dot};
use dymlm_core::{PinholeCamera, Plane, Point, SensorModel};
use dymlm_geometry::{GridSample, PrincipalAxes, SampleGrid};

/// Most planes searched for in a box: the floor, a wall or two, and the front of a desk.
const MAX_PLANES: usize = 4;
/// Number of evenly spread samples outside the box at which a plane is tried.
const SEEDS: usize = 48;
/// Half side, in samples, of the window to which a seed's plane is fitted: large enough to know the normal to
/// some degrees.
const SEED_REACH: i64 = 4;
/// Least share of the samples outside the box that a plane of the background must hold. A lower share takes
/// flat parts of other things for background, a higher one misses a floor of which little is seen beside the
/// box.
const LEAST_SHARE: f32 = 0.05;
/// Half the width, in samples, of the strip in which a plane may cut a body.
const STRIP: i64 = 3;
/// Number of readings that are tested against a plane before the next look at whether the rest can be enough.
const TESTED: usize = 32;
/// Accuracy of a plane fitted to many readings, and evenness of floors and walls, metres.
const EVENNESS: f64 = 0.004;

/// Large planes that continue from a box into its surroundings: the floor on which a mover stands, the wall
/// behind it.
///
/// A mover touches these planes, so readings continue from the mover to them without a step in depth; but a
/// plane that continues beyond the box and the margin around it is not part of the mover. A plane is fitted
/// to readings outside the box. From there it is followed into the box over adjacent readings that lie on it,
/// and into the areas that legs enclose. A plane that only passes through a mover takes nothing from it,
/// because it meets the body only in a narrow strip.
///
/// Reuse the buffer for each box: filling it again allocates only when it must grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Background {
    planes: Vec<CameraPlane>,
    /// For each cell of the grid: 1 + the index of the plane that its sample lies on and is joined to, or 0.
    cells: Vec<u8>,
    columns: usize,
    /// The samples outside the box that no plane holds yet, and those to which a plane is fitted.
    free: Vec<Point>,
    points: Vec<Point>,
    front: Vec<usize>,
}

/// A plane in the camera's frame, with the camera and sensor needed to test readings against it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CameraPlane {
    plane: Plane,
    camera: PinholeCamera,
    sensor: SensorModel,
}

impl CameraPlane {
    /// Whether a reading lies on the plane. Noise acts along the ray, so the tolerance across the plane grows
    /// with the steepness at which the ray meets the plane.
    fn holds(&self, point: [f64; 3]) -> bool {
        let slope = steepness(self.plane.normal(), point);
        let tolerance = slope * self.sensor.tolerance(point[2] as f32, EVENNESS / slope);
        self.plane.signed_distance(point).abs() <= tolerance
    }

    /// How many readings lie on the plane, if they are more than `most`. Ends as soon as they cannot be: most
    /// planes that are tried are no better than one before.
    fn count_above(&self, most: usize, points: &[Point]) -> Option<usize> {
        let (mut count, mut left) = (0, points.len());
        for some in points.chunks(TESTED) {
            count += some.iter().filter(|point| self.holds(point.map(f64::from))).count();
            left -= some.len();
            if count + left <= most {
                return None;
            }
        }
        (count > most).then_some(count)
    }
}

/// The background planes in a cell and its eight neighbours.
#[derive(Debug)]
pub(crate) struct PlanesNear<'a> {
    planes: &'a [CameraPlane],
    /// One bit for each plane.
    near: u8,
}

impl PlanesNear<'_> {
    pub(crate) fn is_empty(&self) -> bool {
        self.near == 0
    }

    /// Whether a reading of the cell lies on one of these planes.
    pub(crate) fn hold(&self, u: usize, v: usize, z: f32) -> bool {
        let near = self.planes.iter().enumerate().filter(|(index, _)| self.near >> index & 1 == 1);
        near.into_iter()
            .any(|(_, plane)| plane.holds(plane.camera.back_project([u as f64, v as f64], z.into())))
    }
}

impl Background {
    /// Finds the planes around a box and the cells of its grid that belong to them.
    pub(super) fn find(&mut self, grid: &SampleGrid, camera: &PinholeCamera, sensor: &SensorModel) {
        self.planes.clear();
        self.cells.clear();
        self.cells.resize(grid.columns * grid.rows, 0);
        self.columns = grid.columns;
        let outside = grid.samples.iter().filter(|sample| !sample.is_in_box).count();
        let least = ((LEAST_SHARE * outside as f32) as usize).max((2 * SEED_REACH + 1).pow(2) as usize);
        while self.planes.len() < MAX_PLANES {
            let Some(plane) = self.best_plane(grid, camera, sensor, outside, least) else { break };
            self.planes.push(plane);
            self.follow(grid, plane);
        }
    }

    /// Drops planes of whose samples in the box more than half are new: a door's leaf, of which the box holds
    /// a part.
    pub(super) fn drop_new(&mut self, grid: &SampleGrid, is_new: impl Fn([f64; 3]) -> bool) {
        let mut balance = [0_i32; MAX_PLANES];
        for sample in grid.samples.iter().filter(|sample| sample.is_in_box) {
            if let Some(plane) = self.plane_of(sample.column, sample.row) {
                balance[plane] += if is_new(sample.point.map(f64::from)) { 1 } else { -1 };
            }
        }
        for cell in self.cells.iter_mut().filter(|cell| **cell > 0 && balance[usize::from(**cell) - 1] > 0) {
            *cell = 0;
        }
    }

    /// Whether the sample of a cell belongs to the background.
    pub(super) fn has_cell(&self, column: u32, row: u32) -> bool {
        self.plane_of(column, row).is_some()
    }

    fn plane_of(&self, column: u32, row: u32) -> Option<usize> {
        let cell = self.cells.get(row as usize * self.columns + column as usize)?;
        usize::from(*cell).checked_sub(1)
    }

    /// The planes to which the cell at a column and row, or one of its eight neighbours, belongs.
    pub(crate) fn planes_near(&self, column: usize, row: usize) -> PlanesNear<'_> {
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let cells = (row.saturating_sub(1)..row + 2).flat_map(|row| {
            let cells = row * self.columns + columns.start..row * self.columns + columns.end;
            self.cells.get(cells).unwrap_or(&[])
        });
        let near = cells.filter(|&&plane| plane > 0).fold(0, |near, &plane| near | 1 << (plane - 1));
        PlanesNear { planes: &self.planes, near }
    }

    /// The plane with the most samples outside the box that no earlier plane holds, fitted to them.
    fn best_plane(
        &mut self,
        grid: &SampleGrid,
        camera: &PinholeCamera,
        sensor: &SensorModel,
        outside: usize,
        least: usize,
    ) -> Option<CameraPlane> {
        let step = (outside / SEEDS).max(1);
        let seeds = grid.samples.iter().filter(|sample| !sample.is_in_box).step_by(step);
        let mut points = std::mem::take(&mut self.points);
        let mut free = std::mem::take(&mut self.free);
        free.clear();
        free.extend(self.free_outside(grid).map(|sample| sample.point));
        let mut best = None;
        let mut most = least;
        for seed in seeds.filter(|seed| !self.has_cell(seed.column, seed.row)) {
            points.clear();
            for row in -SEED_REACH..=SEED_REACH {
                for column in -SEED_REACH..=SEED_REACH {
                    let sample = sample_of(grid, i64::from(seed.column) + column, i64::from(seed.row) + row);
                    points.extend(sample.map(|sample| sample.point));
                }
            }
            let Some(plane) = fitted(&points, camera, sensor) else { continue };
            if let Some(count) = plane.count_above(most, &free) {
                (most, best) = (count, Some(plane));
            }
        }
        let is_on_best = |point: &Point| best.is_some_and(|rough| rough.holds(point.map(f64::from)));
        points.clear();
        points.extend(free.iter().filter(|point| is_on_best(point)));
        (self.points, self.free) = (points, free);
        fitted(&self.points, camera, sensor).filter(|plane| self.goes_on(grid, plane))
    }

    /// Whether a plane continues beyond the margin, as floors and walls do. The part of a mover that a box
    /// cuts off ends within the margin.
    fn goes_on(&self, grid: &SampleGrid, plane: &CameraPlane) -> bool {
        let (last_column, last_row) = (grid.columns as u32 - 1, grid.rows as u32 - 1);
        let is_at_end =
            |s: &GridSample| s.column == 0 || s.column == last_column || s.row == 0 || s.row == last_row;
        let (mut count, mut at_end) = (0_u32, 0_u32);
        for sample in self.free_outside(grid).filter(|sample| plane.holds(sample.point.map(f64::from))) {
            count += 1;
            at_end += u32::from(is_at_end(sample));
        }
        f64::from(at_end) >= f64::from(count).sqrt()
    }

    /// Samples outside the box that no plane holds yet.
    fn free_outside<'a>(&'a self, grid: &'a SampleGrid) -> impl Iterator<Item = &'a GridSample> + 'a {
        grid.samples.iter().filter(|s| !s.is_in_box && !self.has_cell(s.column, s.row))
    }

    /// Marks the newest plane's samples: those outside the box, pieces of the plane in it that are wider than
    /// the strip, and all samples connected to these over other samples of the plane.
    fn follow(&mut self, grid: &SampleGrid, plane: CameraPlane) {
        let number = self.planes.len() as u8;
        self.front.clear();
        for sample in &grid.samples {
            let (column, row) = (i64::from(sample.column), i64::from(sample.row));
            if !sample.is_in_box || is_surrounded(grid, &plane, column, row) {
                self.join(grid, &plane, number, column, row);
            }
        }
        while let Some(cell) = self.front.pop() {
            let (column, row) = ((cell % self.columns) as i64, (cell / self.columns) as i64);
            for (right, down) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                self.join(grid, &plane, number, column + right, row + down);
            }
        }
    }

    fn join(&mut self, grid: &SampleGrid, plane: &CameraPlane, number: u8, column: i64, row: i64) {
        if holds_sample(grid, plane, column, row) {
            let cell = row as usize * self.columns + column as usize;
            if let Some(own) = self.cells.get_mut(cell).filter(|own| **own == 0) {
                *own = number;
                self.front.push(cell);
            }
        }
    }
}

/// The sample of a cell.
fn sample_of(grid: &SampleGrid, column: i64, row: i64) -> Option<&GridSample> {
    // The index of no sample is out of range.
    grid.samples.get(grid.sample_at(column, row) as usize)
}

/// Whether the grid has a sample there that lies on the plane.
fn holds_sample(grid: &SampleGrid, plane: &CameraPlane, column: i64, row: i64) -> bool {
    sample_of(grid, column, row).is_some_and(|sample| plane.holds(sample.point.map(f64::from)))
}

/// How steeply the ray to a point meets a plane with this normal: the distance across the plane by which a
/// noise of 1 along the optical axis moves the reading.
fn steepness(normal: Vector3, point: [f64; 3]) -> f64 {
    dot(normal, point).abs() / point[2].max(1e-3)
}

/// Whether the samples around a sample lie on the plane as it does: a piece of the plane that is wider than
/// the strip in which a plane cuts a body.
fn is_surrounded(grid: &SampleGrid, plane: &CameraPlane, column: i64, row: i64) -> bool {
    // The corners come first because they rule out most samples.
    let around = [-STRIP, STRIP, 0];
    let mut cells = around.into_iter().flat_map(|down| around.map(|right| (right, down)));
    cells.all(|(right, down)| holds_sample(grid, plane, column + right, row + down))
}

/// The least-squares plane through points; `None` when they are too few, on a line, or less even than a plane
/// that the sensor reads.
fn fitted(points: &[Point], camera: &PinholeCamera, sensor: &SensorModel) -> Option<CameraPlane> {
    let axes = PrincipalAxes::of(points).filter(|axes| axes.rank >= 2 && axes.count >= 9)?;
    let normal: Vector3 = axes.axes[2];
    let plane = Plane::new(normal, -dot(normal, axes.centroid)).ok()?;
    let noise = f64::from(sensor.sigma(axes.centroid[2] as f32)) * steepness(normal, axes.centroid);
    let is_even = axes.variances[2] <= 2.0 * (noise * noise + EVENNESS * EVENNESS);
    is_even.then_some(CameraPlane { plane, camera: *camera, sensor: *sensor })
}

#[cfg(test)]
mod tests {
    use dymlm_core::{BoundingBox, DepthImage, Frame};
    use dymlm_geometry::{BoxSegmenter, BoxView, SegmentationConfig};

    use super::*;

    const CAMERA_HEIGHT: f64 = 1.2;

    /// Two legs, 12 cm wide and round, on a floor before a wall at 4 m; and the background of their box.
    fn background(floor_goes_on: bool) -> (Frame, SampleGrid, Background) {
        let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
        let (left, right) = (290..322, 350..382);
        let depth = (0..640 * 480).map(|i| {
            let (u, v) = (i % 640, i / 640);
            let down = (f64::from(v) - camera.cy()) / camera.fy();
            let floor = if down > 0.0 { CAMERA_HEIGHT / down } else { f64::INFINITY };
            for leg in [&left, &right] {
                if leg.contains(&u) && (100..410).contains(&v) {
                    let across = (f64::from(u) - f64::from(leg.start + leg.end) / 2.0) / 16.0;
                    return (2.0 - 0.06 * (1.0 - across * across).sqrt()) as f32;
                }
            }
            let is_floor = floor < 4.0 && (floor_goes_on || ((284..386).contains(&u) && v < 432));
            if is_floor { floor as f32 } else { 4.0 }
        });
        let depth = DepthImage::new(640, 480, depth.collect()).unwrap();
        let frame = Frame::new(0.0, camera, depth, None).unwrap();
        let sensor = SensorModel::kinect();
        let mut config = SegmentationConfig::default();
        config.spacing = 4.0;
        config.margin = 50.0;
        let segmenter = BoxSegmenter::new(config).unwrap();
        let mut grid = SampleGrid::default();
        let bounding_box = BoundingBox::new(280.0, 100.0, 390.0, 440.0).unwrap();
        segmenter.sample(&BoxView::new(&frame, &sensor, bounding_box), &mut grid);
        let mut background = Background::default();
        background.find(&grid, &camera, &sensor);
        (frame, grid, background)
    }

    fn is_background(grid: &SampleGrid, background: &Background, u: usize, v: usize) -> bool {
        let cell = |pixel: usize, axis: usize| ((pixel - grid.first[axis]) / grid.stride) as u32;
        background.has_cell(cell(u, 0), cell(v, 1))
    }

    #[test]
    fn floor_and_wall_are_background_and_what_stands_on_the_floor_is_not() {
        let (_, grid, background) = background(true);
        for v in [420, 436] {
            assert!(is_background(&grid, &background, 300, v), "the floor at row {v}");
        }
        assert!(is_background(&grid, &background, 336, 400), "the floor between the feet");
        assert!(is_background(&grid, &background, 336, 200), "the wall between the legs");
        for v in [120, 250, 380] {
            assert!(!is_background(&grid, &background, 306, v), "the leg at row {v}");
        }
    }

    #[test]
    fn a_plane_that_ends_in_the_box_is_not_background() {
        let (_, grid, background) = background(false);
        assert!(!is_background(&grid, &background, 310, 420));
    }
}

use dymlm_core::vector3::{Vector3, dot};
use dymlm_core::{PinholeCamera, Plane, Point, SensorModel};
use dymlm_geometry::{GridSample, NO_SAMPLE, PrincipalAxes, SampleGrid};

/// Planes that are looked for in a box: the floor, a wall or two, and the front of a desk.
const MAX_PLANES: usize = 4;
/// Samples outside the box, evenly spread, at which a plane is tried.
const SEEDS: usize = 48;
/// Half side of the window of samples that a seed's plane is fitted to: its normal is known to some degrees.
const SEED_REACH: i64 = 4;
/// Least share of the samples outside the box that lie on a plane of the background. Less takes the flat
/// parts of other things for it, more misses a floor of which little is seen beside the box.
const LEAST_SHARE: f32 = 0.05;
/// Half the width of the strip in which a plane may cut a body, samples.
const STRIP: i64 = 3;
/// How well a plane fitted to many readings is known, and how even floors and walls are, metres.
const EVENNESS: f64 = 0.004;

/// Large planes that a box shares with what lies around it: the floor on which a mover stands, the wall
/// behind it.
///
/// A mover touches them, so that readings run on from it to them without a step in depth; but it is no plane
/// that goes on beyond its box and the margin around it. A plane is fitted to readings outside the box, and from there it is followed
/// into the box over readings that lie on it, without a gap, and to what legs enclose of it. A plane that only
/// passes through a mover takes nothing from it: it meets the body in a strip.
///
/// A buffer to keep: filled again for each box, it allocates only to grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Background {
    planes: Vec<CameraPlane>,
    /// For each cell of the grid 1 + the plane that its sample lies on and is joined to, or 0.
    cells: Vec<u8>,
    columns: usize,
    points: Vec<Point>,
    front: Vec<usize>,
}

/// A plane in the camera's frame, and what tells a pixel's distance from it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CameraPlane {
    plane: Plane,
    /// Of the pixel (u, v): its ray at depth 1 is ((u - cx) / fx, (v - cy) / fy, 1).
    inverse_focal: [f64; 2],
    center: [f64; 2],
    sensor: SensorModel,
}

impl CameraPlane {
    /// Whether a reading lies on the plane: its noise is along the ray, and counts as far as the ray meets
    /// the plane steeply.
    fn holds(&self, pixel: [f64; 2], z: f32) -> bool {
        let ray = [
            (pixel[0] - self.center[0]) * self.inverse_focal[0],
            (pixel[1] - self.center[1]) * self.inverse_focal[1],
            1.0,
        ];
        let slope = dot(self.plane.normal(), ray);
        let distance = slope * f64::from(z) + self.plane.d();
        let noise = f64::from(self.sensor.sigma(z)) * slope;
        distance * distance <= 9.0 * (noise * noise + EVENNESS * EVENNESS)
    }
}

impl Background {
    /// Finds the planes around a box, and which cells of its grid belong to them.
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

    /// Whether the sample of a cell belongs to the background.
    pub(super) fn has_cell(&self, column: u32, row: u32) -> bool {
        self.cells.get(row as usize * self.columns + column as usize).is_some_and(|&plane| plane > 0)
    }

    /// Whether the cell at a column and row, or one of the eight around it, belongs to the background.
    pub(crate) fn is_near(&self, column: usize, row: usize) -> bool {
        self.planes_near(column, row).any(|_| true)
    }

    /// Whether a reading belongs to the background, which its cell or one of the eight around it touches.
    pub(crate) fn holds(&self, cell: [usize; 2], pixel: [usize; 2], z: f32) -> bool {
        self.planes_near(cell[0], cell[1]).any(|plane| plane.holds(pixel.map(|c| c as f64), z))
    }

    fn planes_near(&self, column: usize, row: usize) -> impl Iterator<Item = &CameraPlane> {
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let rows = row.saturating_sub(1)..row + 2;
        let near = rows.flat_map(move |row| {
            let cells = row * self.columns + columns.start..row * self.columns + columns.end;
            self.cells.get(cells).unwrap_or(&[])
        });
        let near = near.fold(0_u8, |planes, &plane| planes | 1_u8.checked_shl(plane.into()).unwrap_or(0));
        self.planes.iter().enumerate().filter(move |(index, _)| near >> (index + 1) & 1 == 1).map(|(_, p)| p)
    }

    /// The plane with the most free samples outside the box, fitted to them.
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
        let mut best = None;
        let mut most = least;
        for seed in seeds.filter(|seed| !self.has_cell(seed.column, seed.row)) {
            points.clear();
            for row in -SEED_REACH..=SEED_REACH {
                for column in -SEED_REACH..=SEED_REACH {
                    let sample = grid.sample_at(i64::from(seed.column) + column, i64::from(seed.row) + row);
                    let sample = (sample != NO_SAMPLE).then(|| grid.samples.get(sample as usize)).flatten();
                    points.extend(sample.map(|sample| sample.point));
                }
            }
            let Some(plane) = fitted(&points, camera, sensor) else { continue };
            let count = self.free_outside(grid, &plane).count();
            if count > most {
                (most, best) = (count, Some(plane));
            }
        }
        points.clear();
        points.extend(best.iter().flat_map(|rough| self.free_outside(grid, rough)).map(|s| s.point));
        self.points = points;
        fitted(&self.points, camera, sensor).filter(|plane| self.goes_on(grid, plane))
    }

    /// Whether a plane goes on beyond the margin, as floors and walls do; the part of a mover that a box cuts
    /// off ends within it.
    fn goes_on(&self, grid: &SampleGrid, plane: &CameraPlane) -> bool {
        let (last_column, last_row) = (grid.columns as u32 - 1, grid.rows as u32 - 1);
        let is_at_end =
            |s: &GridSample| s.column == 0 || s.column == last_column || s.row == 0 || s.row == last_row;
        let (mut count, mut at_end) = (0_u32, 0_u32);
        for sample in self.free_outside(grid, plane) {
            count += 1;
            at_end += u32::from(is_at_end(sample));
        }
        f64::from(at_end) >= f64::from(count).sqrt()
    }

    /// Samples outside the box that lie on a plane and on none before.
    fn free_outside<'a>(
        &'a self,
        grid: &'a SampleGrid,
        plane: &'a CameraPlane,
    ) -> impl Iterator<Item = &'a GridSample> + 'a {
        let free = grid.samples.iter().filter(|s| !s.is_in_box && !self.has_cell(s.column, s.row));
        free.filter(|s| {
            let [u, v] = grid.pixel(s.column as usize, s.row as usize);
            plane.holds([u as f64, v as f64], s.point[2])
        })
    }

    /// Marks the newest plane's samples that are joined to the outside of the box over others of it.
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

/// Whether the grid has a sample there that lies on the plane.
fn holds_sample(grid: &SampleGrid, plane: &CameraPlane, column: i64, row: i64) -> bool {
    let index = grid.sample_at(column, row);
    let sample = (index != NO_SAMPLE).then(|| grid.samples.get(index as usize)).flatten();
    sample.is_some_and(|sample| {
        let [u, v] = grid.pixel(column as usize, row as usize);
        plane.holds([u as f64, v as f64], sample.point[2])
    })
}

/// Whether the samples around one lie on the plane like itself: a piece of it, wider than the strip in which
/// it cuts a body.
fn is_surrounded(grid: &SampleGrid, plane: &CameraPlane, column: i64, row: i64) -> bool {
    // The corners first: they rule most samples out.
    let around = [-STRIP, STRIP, 0];
    let mut cells = around.into_iter().flat_map(|down| around.map(|right| (right, down)));
    cells.all(|(right, down)| holds_sample(grid, plane, column + right, row + down))
}

/// The plane of closest fit to points, when they are a plane: as even as the sensor reads one.
fn fitted(points: &[Point], camera: &PinholeCamera, sensor: &SensorModel) -> Option<CameraPlane> {
    let axes = PrincipalAxes::of(points).filter(|axes| axes.rank >= 2 && axes.count >= 9)?;
    let normal: Vector3 = axes.axes[2];
    let plane = Plane::new(normal, -dot(normal, axes.centroid)).ok()?;
    let ray = axes.centroid.map(|c| c / axes.centroid[2].max(1e-3));
    let noise = f64::from(sensor.sigma(axes.centroid[2] as f32)) * dot(normal, ray);
    let is_even = axes.variances[2] <= 2.0 * (noise * noise + EVENNESS * EVENNESS);
    is_even.then(|| CameraPlane {
        plane,
        inverse_focal: [1.0 / camera.fx(), 1.0 / camera.fy()],
        center: [camera.cx(), camera.cy()],
        sensor: *sensor,
    })
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

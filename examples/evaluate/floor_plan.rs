use std::path::Path;

use dymlm::core::{PointCloud, Rgb};
use dymlm::files::plane_cloud;
use dymlm::octree::{CellState, MapFile};
use dymlm::{MultiLevelMap, ObjectMap};
use dymlm_examples::{AnyError, NamedSequence, Orthographic, SequenceSet};
use dymlm_io::write_png;
use dymlm_sim::{BuildingPlan, PlanCell, PlanGrid, Sequence, SequenceConfig, Truth};

use crate::Arguments;
use crate::residue_picture::draw_point;
use crate::subjects::{Subject, hold_camera};

/// A building with the walls of a floor plan.
pub(crate) fn subject(arguments: &Arguments, file: &Path) -> Result<Subject, AnyError> {
    let plan = BuildingPlan::new(&read(file)?, arguments.wall_height)
        .map_err(|error| format!("{}: {error}", file.display()))?;
    println!(
        "{}: {} faces of walls, {:.0} square metres to walk on",
        file.display(),
        plan.wall_count(),
        plan.open_area()
    );
    let mut config = SequenceConfig::planned_building(plan, arguments.seed, arguments.rate, arguments.frames);
    hold_camera(arguments, &mut config);
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let name = format!("plan_{name}_{}", arguments.seed);
    Subject::new(NamedSequence { name, config, set: SequenceSet::Building }, arguments.every)
}

/// Reads a plan from the files of ROS's map server.
fn read(file: &Path) -> Result<PlanGrid, AnyError> {
    let map = MapFile::load(file)?;
    let [x, y, yaw] = map.origin;
    if yaw != 0.0 {
        return Err(format!(
            "{}: the plan is turned by {yaw} radians, which is not supported",
            file.display()
        )
        .into());
    }
    let cell = |state: &CellState| match state {
        CellState::Occupied => PlanCell::Occupied,
        CellState::Free => PlanCell::Free,
        CellState::Unknown => PlanCell::Unknown,
    };
    let cells = map.cells.iter().map(cell).collect();
    Ok(PlanGrid { width: map.width, height: map.height, resolution: map.resolution, origin: [x, y], cells })
}

/// A floor plan with the camera's way, the cloud, and planes with the boxes of objects, from above beside each other.
pub(crate) struct PlanPicture {
    width: usize,
    height: usize,
    pixels: Vec<Rgb>,
}

/// What is nearer to the ceiling than this is not drawn, since it occludes the room, metres.
const CEILING: f64 = 0.3;
/// White between the parts, pixels.
const GAP: usize = 10;
const WALL: Rgb = [0; 3];
const UNKNOWN: Rgb = [205; 3];
const FLOOR: Rgb = [250; 3];
const WAY: Rgb = [40, 90, 220];
const OBJECT: Rgb = [210, 30, 30];

impl PlanPicture {
    /// Draws the maps of a sequence; `None` when it was not taken in a building made from a floor plan.
    pub(crate) fn draw(
        map: &MultiLevelMap,
        cloud: &PointCloud,
        truth: &Truth,
        sequence: &Sequence,
    ) -> Option<Self> {
        let plan = sequence.config().plan.as_ref()?;
        let grid = plan.grid();
        let [left, bottom] = grid.origin;
        let (right, top) =
            (left + grid.width as f64 * grid.resolution, bottom + grid.height as f64 * grid.resolution);
        let corners = [[left, bottom, 0.0], [right, top, 0.0]];
        let view = || Orthographic::onto([0.0, 0.0, -1.0], [0.0, -1.0, 0.0], corners.into_iter());
        let highest = plan.wall_height() - CEILING;
        let below_ceiling = |point: &&[f32; 3]| f64::from(point[2]) < highest;

        let mut of_plan = view();
        for (k, cell) in grid.cells.iter().enumerate() {
            let color = match cell {
                PlanCell::Occupied => WALL,
                PlanCell::Free => FLOOR,
                PlanCell::Unknown => UNKNOWN,
            };
            let place = [k % grid.width, k / grid.width].map(|c| (c as f64 + 0.5) * grid.resolution);
            of_plan.draw([left + place[0], bottom + place[1], 0.0], grid.resolution, color);
        }
        for index in 0..sequence.len() {
            of_plan.draw(sequence.world_from_camera(index).translation(), 0.06, WAY);
        }

        let mut of_cloud = view();
        let colors = cloud.colors().unwrap_or_default();
        for (index, &point) in cloud.points().iter().enumerate().filter(|(_, point)| below_ceiling(point)) {
            draw_point(&mut of_cloud, point, colors.get(index), truth);
        }

        let mut of_planes = view();
        let planes = plane_cloud(map.planes());
        let colors = planes.colors().unwrap_or_default();
        for (point, color) in planes.points().iter().zip(colors).filter(|(point, _)| below_ceiling(point)) {
            of_planes.draw(point.map(f64::from), map.planes().config().voxel_size, *color);
        }
        outline_objects(map.objects(), &mut of_planes);
        Some(Self::side_by_side(&[of_plan, of_cloud, of_planes]))
    }

    fn side_by_side(views: &[Orthographic]) -> Self {
        let width = views.iter().map(|view| view.width() + GAP).sum::<usize>().saturating_sub(GAP);
        let height = views.iter().map(Orthographic::height).max().unwrap_or(0);
        let mut pixels = vec![[255; 3]; width * height];
        let mut left = 0;
        for view in views {
            for (row, drawn) in pixels.chunks_mut(width).zip(view.pixels().chunks(view.width())) {
                row[left..left + drawn.len()].copy_from_slice(drawn);
            }
            left += view.width() + GAP;
        }
        Self { width, height, pixels }
    }

    /// Writes it as `map_NAME.png`.
    pub(crate) fn write(&self, name: &str, folder: &Path) -> Result<(), AnyError> {
        Ok(write_png(folder.join(format!("map_{name}.png")), self.width, self.height, &self.pixels)?)
    }
}

/// Draws the outlines of all objects' boxes, above everything else.
fn outline_objects(objects: &ObjectMap, view: &mut Orthographic) {
    const STEPS: u8 = 40;
    for object in objects.objects() {
        let (world_from_box, half) =
            (object.oriented_box().world_from_box(), object.oriented_box().lengths().map(|c| 0.5 * c));
        for k in 0..STEPS {
            let along = 2.0 * f64::from(k) / f64::from(STEPS) - 1.0;
            for [x, y] in [[along, -1.0], [along, 1.0], [-1.0, along], [1.0, along]] {
                let [x, y, _] = world_from_box.transform_point([x * half[0], y * half[1], half[2]]);
                view.draw([x, y, 1e3], 0.0, OBJECT);
            }
        }
    }
}

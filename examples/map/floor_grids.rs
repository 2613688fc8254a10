use std::path::{Path, PathBuf};

use clap::Args;
use dymlm::octree::{CellState, GridRegion, OccupancyGrid};
use dymlm::{FloorGrid, FloorGridConfig};
use dymlm_examples::{AnyError, up_of_map};

use crate::{load_to_look, triple};

#[derive(Args)]
pub(crate) struct GridArguments {
    /// The map's folder
    map: PathBuf,
    /// The grid's .yaml file; the image is written beside it. With several floors, names end in a number, 0
    /// for the lowest
    #[arg(long, default_value = "map.yaml")]
    out: PathBuf,
    /// Where the robot is, above its floor, in the map's world: x y z. Without it, the lowest floor is taken
    #[arg(long, num_args = 3, allow_hyphen_values = true, value_names = ["X", "Y", "Z"])]
    at: Option<Vec<f64>>,
    /// Writes one grid for each floor
    #[arg(long, conflicts_with = "at")]
    floors: bool,
    /// The approximate up direction in the map's world, if the map does not know it: x y z
    #[arg(long, num_args = 3, allow_hyphen_values = true, value_names = ["X", "Y", "Z"])]
    up: Option<Vec<f64>>,
    /// Lowest height above the floor at which something is an obstacle, metres
    #[arg(long, default_value_t = FloorGridConfig::default().min_height)]
    min_height: f64,
    /// Greatest height above the floor at which something is an obstacle, metres
    #[arg(long, default_value_t = FloorGridConfig::default().max_height)]
    max_height: f64,
    /// Highest step across which a floor continues, metres
    #[arg(long, default_value_t = FloorGridConfig::default().max_step)]
    max_step: f64,
    /// Steepest floor, degrees
    #[arg(long, default_value_t = FloorGridConfig::default().max_slope_deg)]
    max_slope: f64,
    /// Inflates obstacles by this margin, metres: the robot's radius
    #[arg(long, default_value_t = 0.0)]
    inflate: f64,
    /// Only this region, in the grid's axes (for upright maps the world's): lowest x y, greatest x y
    #[arg(long, num_args = 4, allow_hyphen_values = true, value_names = ["X0", "Y0", "X1", "Y1"])]
    region: Option<Vec<f64>>,
}

/// Makes the requested grids, and writes a .yaml and a .pgm file for each.
pub(crate) fn write(arguments: &GridArguments) -> Result<(), AnyError> {
    let map = load_to_look(&arguments.map)?;
    let up = up_of_map(&map, arguments.up.as_deref().map(triple))?;
    let config = config_of(arguments);
    let floors = match &arguments.at {
        Some(at) => vec![map.floor_grid(triple(at), up, &config)?],
        None => map.floor_grids(up, &config)?,
    };
    if floors.is_empty() {
        return Err("no floor is known: no level plane is large enough".into());
    }
    let name =
        arguments.out.file_stem().and_then(|name| name.to_str()).ok_or("the .yaml file needs a name")?;
    let folder = arguments.out.parent().unwrap_or(Path::new(""));
    let taken = if arguments.floors { floors.len() } else { 1 };
    for (number, floor) in floors.iter().take(taken).enumerate() {
        let name = if arguments.floors { format!("{name}_{number}") } else { name.to_owned() };
        let grid = floor.grid().inflated(arguments.inflate)?;
        let grid = match region_of(arguments) {
            Some(region) => grid.cropped(&region)?,
            None => grid,
        };
        grid.save(folder, &name)?;
        println!("{}: {}", folder.join(format!("{name}.yaml")).display(), described(floor, &grid));
    }
    Ok(())
}

fn config_of(arguments: &GridArguments) -> FloorGridConfig {
    let mut config = FloorGridConfig::default();
    (config.min_height, config.max_height) = (arguments.min_height, arguments.max_height);
    (config.max_step, config.max_slope_deg) = (arguments.max_step, arguments.max_slope);
    // Obstacles just outside of the region reach into it.
    let beside = arguments.inflate.max(0.0);
    config.region = region_of(arguments).map(|GridRegion { min, max }| GridRegion {
        min: min.map(|c| c - beside),
        max: max.map(|c| c + beside),
    });
    config
}

fn region_of(arguments: &GridArguments) -> Option<GridRegion> {
    match *arguments.region.as_deref()? {
        [x, y, max_x, max_y] => Some(GridRegion { min: [x, y], max: [max_x, max_y] }),
        _ => None,
    }
}

fn described(floor: &FloorGrid, grid: &OccupancyGrid) -> String {
    let count = |state| grid.cells().iter().filter(|&&cell| cell == state).count();
    format!(
        "{}x{} cells of {} m, {} occupied, {} free, floor of {} planes",
        grid.width(),
        grid.height(),
        grid.resolution(),
        count(CellState::Occupied),
        count(CellState::Free),
        floor.planes().len()
    )
}

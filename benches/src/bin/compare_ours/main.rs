//! Our side of `benches/compare`: runs an operation on given input on each request, and answers how long it
//! took. `compare.py` starts it beside the other libraries' programs, which use the same protocol:
//!
//! - a request is a line on standard input, `operation key=value key=value ..`;
//! - the answer is a line on standard output, `ok wall_seconds cpu_seconds` or `error message`;
//! - with `result=PATH` in the request, the result is written to that file after the time is measured.
//!
//! Inputs are read once and kept. Files are raw little-endian numbers, described in [`inputs`] and
//! [`results`].

mod assignment;
mod dbscan;
mod inputs;
mod isolation_forest;
mod minimum_area_rectangle;
mod octree;
mod oriented_box;
mod planes;
mod pose_graph;
mod request;
mod results;
mod static_cloud;
mod timing;
mod tracking;
mod voxel_grid;

use std::error::Error;
use std::io::{BufRead, Write, stdin, stdout};

use request::Request;
use timing::Timing;

/// Any error is reported to the script as text.
type Failure = Box<dyn Error>;

/// The data that each operation keeps between requests.
#[derive(Default)]
struct Contestant {
    inputs: inputs::Inputs,
    dbscan: dbscan::Buffers,
    voxel_grid: voxel_grid::Buffers,
    octree: octree::Maps,
    recordings: static_cloud::Recordings,
    sequences: tracking::Sequences,
    rectangle: dymlm_geometry::MinimumAreaRectangleScratch,
    oriented_box: dymlm_geometry::OrientedBoxScratch,
    isolation_forest: isolation_forest::Buffers,
    planes: planes::Planes,
    assignments: assignment::Assignments,
    pose_graphs: pose_graph::PoseGraphs,
}

impl Contestant {
    fn run(&mut self, request: &Request) -> Result<Timing, Failure> {
        match request.operation() {
            "dbscan" => dbscan::run(request, &mut self.inputs, &mut self.dbscan),
            "voxel_grid" => voxel_grid::run(request, &mut self.inputs, &mut self.voxel_grid),
            "octree_insert" => octree::insert(request, &mut self.inputs),
            "octree_cast" => octree::cast(request, &mut self.inputs, &mut self.octree),
            "octree_query" => octree::query(request, &mut self.inputs, &mut self.octree),
            "minimum_area_rectangle" => {
                minimum_area_rectangle::run(request, &mut self.inputs, &mut self.rectangle)
            }
            "oriented_box" => oriented_box::run(request, &mut self.inputs, &mut self.oriented_box),
            "isolation_forest_fit" => {
                isolation_forest::fit(request, &mut self.inputs, &mut self.isolation_forest)
            }
            "isolation_forest_scores" => {
                isolation_forest::scores(request, &mut self.inputs, &mut self.isolation_forest)
            }
            "planes" => planes::run(request, &mut self.inputs, &mut self.planes),
            "assignment" => assignment::run(request, &mut self.inputs, &mut self.assignments),
            "pose_graph" => pose_graph::run(request, &mut self.pose_graphs),
            "static_cloud" => static_cloud::run(request, &mut self.inputs, &mut self.recordings),
            "kcf" => tracking::kcf(request, &mut self.sequences),
            "optical_flow" => tracking::optical_flow(request, &mut self.sequences),
            unknown => Err(format!("no operation {unknown}").into()),
        }
    }
}

fn main() -> Result<(), Failure> {
    let mut contestant = Contestant::default();
    for line in stdin().lock().lines() {
        let answer = match Request::parse(&line?).and_then(|request| contestant.run(&request)) {
            Ok(Timing { wall, cpu }) => format!("ok {:.9} {:.9}", wall.as_secs_f64(), cpu.as_secs_f64()),
            Err(failure) => format!("error {failure}"),
        };
        let mut out = stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

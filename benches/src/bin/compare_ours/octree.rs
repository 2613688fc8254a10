use std::collections::BTreeMap;

use dymlm_core::Point;
use dymlm_octree::{Octree, OctreeConfig, RayMode, UnknownCells};

use crate::Failure;
use crate::inputs::{Inputs, Scan};
use crate::request::Request;
use crate::results::{write_hits, write_leaves, write_states};
use crate::timing::{Timing, timed};

/// Maps for queries, by the request's `frames`, `resolution` and `max_range`.
#[derive(Default)]
pub(crate) struct Maps(BTreeMap<String, Octree>);

/// `octree_insert frames= limit= resolution= max_range= rays=per_cell|per_point`: inserts the first `limit`
/// frames into a new map.
pub(crate) fn insert(request: &Request, inputs: &mut Inputs) -> Result<Timing, Failure> {
    let mut map = Octree::new(config(request)?)?;
    let frames = inputs.frames(request.text("frames")?)?;
    let frames = &frames[..frames.len().min(request.number("limit")?)];

    let (inserted, timing) = timed(|| insert_all(&mut map, frames));
    inserted?;
    if let Some(path) = request.result() {
        write_leaves(path, &map)?;
    }
    Ok(timing)
}

/// `octree_cast frames= resolution= max_range= rays_file= cast_range=`: casts rays through unknown cells, up
/// to the first occupied one.
pub(crate) fn cast(request: &Request, inputs: &mut Inputs, maps: &mut Maps) -> Result<Timing, Failure> {
    let map = maps.get(request, inputs)?;
    let range = request.number("cast_range")?;
    let rays = inputs.rays(request.text("rays_file")?)?;

    let mut hits = Vec::with_capacity(rays.len());
    let ((), timing) = timed(|| {
        for ray in rays {
            hits.push(map.cast_ray(
                ray.origin.map(f64::from),
                ray.direction.map(f64::from),
                range,
                UnknownCells::Pass,
            ));
        }
    });
    if let Some(path) = request.result() {
        write_hits(path, &hits)?;
    }
    Ok(timing)
}

/// `octree_query frames= resolution= max_range= points= reader=map|accessor`: the state of the cell at each
/// point.
pub(crate) fn query(request: &Request, inputs: &mut Inputs, maps: &mut Maps) -> Result<Timing, Failure> {
    let map = maps.get(request, inputs)?;
    let points = inputs.points(request.text("points")?)?;

    let mut states = Vec::with_capacity(points.len());
    let widened = |point: &Point| point.map(f64::from);
    let ((), timing) = match request.text("reader")? {
        "map" => timed(|| states.extend(points.iter().map(|point| map.state(widened(point))))),
        "accessor" => timed(|| {
            let mut accessor = map.accessor();
            states.extend(points.iter().map(|point| accessor.state(widened(point))));
        }),
        other => return Err(format!("reader={other} is neither map nor accessor").into()),
    };
    if let Some(path) = request.result() {
        write_states(path, &states)?;
    }
    Ok(timing)
}

impl Maps {
    /// The map of all frames, built at the first request.
    fn get(&mut self, request: &Request, inputs: &mut Inputs) -> Result<&Octree, Failure> {
        let frames = request.text("frames")?;
        let name = format!("{frames} {} {}", request.text("resolution")?, request.text("max_range")?);
        if !self.0.contains_key(&name) {
            let mut map = Octree::new(config(request)?)?;
            insert_all(&mut map, inputs.frames(frames)?)?;
            self.0.insert(name.clone(), map);
        }
        Ok(self.0.get(&name).ok_or("no such map")?)
    }
}

fn config(request: &Request) -> Result<OctreeConfig, Failure> {
    let mut config = OctreeConfig::default();
    config.resolution = request.number("resolution")?;
    config.max_range = request.number("max_range")?;
    config.rays = match request.text("rays")? {
        "per_cell" => RayMode::PerCell,
        "per_point" => RayMode::PerPoint,
        other => return Err(format!("rays={other} is neither per_cell nor per_point").into()),
    };
    Ok(config)
}

fn insert_all(map: &mut Octree, frames: &[Scan]) -> Result<(), dymlm_octree::Error> {
    for frame in frames {
        map.insert_scan(frame.origin.map(f64::from), &frame.points)?;
    }
    Ok(())
}

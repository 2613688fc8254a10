use std::collections::{BTreeMap, BTreeSet};

use dymlm::core::Point;
use dymlm::geometry::OrientedBox;
use dymlm::octree::CellState;
use dymlm::planes::MapPlane;
use dymlm::{MultiLevelMap, Selection};
use dymlm_metrics::SpaceTruth;
use dymlm_sim::{SceneChange, Sequence, SimulatedFrame, Truth};

use crate::columns::Scores;

/// Measures how soon the maps follow the changes of events: a place that becomes empty, and one that is
/// filled.
pub(crate) struct ChangeWatch {
    watched: Vec<Watched>,
    next_check: f64,
}

struct Watched {
    change: SceneChange,
    /// When the freed place and the filled one were first in view after the change.
    looked: [Option<f64>; 2],
    /// The looks through the cells of the freed place since the change.
    freed: BTreeMap<Cell, Looks>,
    checks: Vec<Check>,
}

/// The looks through a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Looks {
    count: u32,
    /// When there were enough of them that the cell is known to be empty.
    known: Option<f64>,
}

/// What the maps hold at the old and at the new place.
struct Check {
    time: f64,
    cells: [[BTreeSet<Cell>; 2]; 3],
    objects: [bool; 2],
}

/// A cube of 5 cm.
type Cell = [i32; 3];

/// Side of a cell, metres.
const CELL: f64 = 0.05;
/// Half of its diagonal, metres.
const HALF_DIAGONAL: f64 = 0.043_3;
/// Frames that must look through a cell before a map is asked to know that it is empty, as for free space in
/// general.
const LEAST_LOOKS: u32 = 3;

/// Time between two checks of the maps, seconds.
const CHECK_TIME: f64 = 0.5;
/// Height at the bottom of the boxes that is left out, because of the floor, metres.
const ABOVE_FLOOR: f64 = 0.06;
/// Ghosts are at least this far from surfaces that stand at the end, metres.
const OFF_SURFACE: f32 = 0.1;
/// A place is empty when at most this share of what a map held there is left, and filled when the map holds
/// this share of what was seen of it.
const EMPTY: f64 = 0.03;
const FILLED: f64 = 0.5;

impl ChangeWatch {
    pub(crate) fn new(sequence: &Sequence) -> Self {
        let watched = |change: SceneChange| {
            let freed = change.before.map(|place| cells_of(&place)).unwrap_or_default();
            Watched { change, looked: [None; 2], freed, checks: Vec::new() }
        };
        Self { watched: sequence.changes().into_iter().map(watched).collect(), next_check: 0.0 }
    }

    /// Checks the maps after a frame was inserted.
    pub(crate) fn check(&mut self, frame: &SimulatedFrame, map: &MultiLevelMap, truth: &Truth) {
        let time = frame.frame.timestamp();
        for watched in &mut self.watched {
            watched.note_looks(frame);
        }
        let begins = self.watched.iter().map(|watched| watched.change.times[0]).fold(f64::INFINITY, f64::min);
        if time < self.next_check || time < begins - 2.0 * CHECK_TIME {
            return;
        }
        self.next_check = time + CHECK_TIME;
        let occupied = map.octree().leaves().filter(|leaf| leaf.state == CellState::Occupied);
        let all = [
            map.cloud().point_cloud(Selection::Static).points().to_vec(),
            occupied.map(|leaf| leaf.center.map(|c| c as f32)).collect(),
            map.planes().iter().flat_map(MapPlane::inlier_points).collect(),
        ];
        for Watched { change, checks, .. } in &mut self.watched {
            let cells = all.each_ref().map(|points| {
                let off_surface = |point: &&Point| truth.surface_distance(**point) > OFF_SURFACE;
                let before = change.before.map(|place| cells_in(&place, points.iter().filter(off_surface)));
                let after = change.after.map(|place| cells_in(&place, points.iter()));
                [before, after].map(Option::unwrap_or_default)
            });
            let objects = [change.before, change.after].map(|place| {
                let holds = |place: OrientedBox| {
                    map.objects().objects().any(|object| place.contains(object.oriented_box().center()))
                };
                place.is_some_and(holds)
            });
            checks.push(Check { time, cells, objects });
        }
    }

    /// The slowest of all changes, and the share of the cells held that no frame has looked through again.
    pub(crate) fn score(&self, truth: &Truth, scores: &mut Scores) {
        let visible = truth.visible_points();
        let mut note = |key: &'static str, time: Option<f64>| {
            let slowest = scores.get(key).into_iter().chain(time).fold(f64::NEG_INFINITY, f64::max);
            scores.set(key, time.map(|_| slowest));
        };
        let gone = ["changes.cloud.gone", "changes.octree.gone", "changes.planes.gone"];
        let there = ["changes.cloud.there", "changes.octree.there", "changes.planes.there"];
        for watched in &self.watched {
            let true_cells =
                watched.change.after.map(|place| cells_in(&place, visible.iter())).unwrap_or_default();
            for (map, (gone, there)) in gone.into_iter().zip(there).enumerate() {
                let held = watched.held_before(|check| check.cells[map][0].len() as f64);
                note(gone, (held > 0.0).then(|| watched.gone(map, EMPTY * held)).flatten());
                // A chair has no plane large enough to be expected of a map.
                let is_asked = !true_cells.is_empty() && (map < 2 || watched.change.label.is_none());
                let filled = |check: &Check| covered(&true_cells, &check.cells[map][1]) as f64;
                note(
                    there,
                    watched.time(1, is_asked, |check| filled(check) >= FILLED * true_cells.len() as f64),
                );
            }
            let held = watched.held_before(|check| f64::from(u8::from(check.objects[0])));
            note("changes.objects.gone", watched.time(0, held > 0.0, |check| !check.objects[0]));
            let is_asked = watched.change.label.is_some() && watched.change.after.is_some();
            note("changes.objects.there", watched.time(1, is_asked, |check| check.objects[1]));
            note("changes.cloud.unseen", watched.unseen());
        }
    }
}

impl Watched {
    fn note_looks(&mut self, frame: &SimulatedFrame) {
        let time = frame.frame.timestamp();
        let places = [self.change.before, self.change.after];
        for (place, looked) in places.into_iter().zip(&mut self.looked) {
            if time >= self.change.times[1] && looked.is_none() {
                *looked = place.filter(|place| is_looked_at(place, frame)).map(|_| time);
            }
        }
        if time >= self.change.times[1] {
            for (cell, looks) in self.freed.iter_mut().filter(|(_, looks)| looks.known.is_none()) {
                looks.count += u32::from(looks_through(*cell, frame));
                looks.known = (looks.count >= LEAST_LOOKS).then_some(time);
            }
        }
    }

    /// How long after it was known to be empty a cell was still held at most, but for the slowest `spared` of
    /// them. `None` when too few frames looked at the place.
    fn gone(&self, map: usize, spared: f64) -> Option<f64> {
        // None of its cells was looked through often enough to be known as empty.
        if self.looked[0].is_none() || self.freed.values().all(|looks| looks.known.is_none()) {
            return None;
        }
        let slowest = self.checks.iter().filter_map(|check| {
            let held = check.cells[map][0].iter();
            let known = held.filter_map(|cell| self.freed.get(cell)?.known);
            let mut waits: Vec<f64> =
                known.map(|known| check.time - known).filter(|&wait| wait >= 0.0).collect();
            waits.sort_by(|a, b| b.total_cmp(a));
            waits.get(spared as usize).map(|wait| wait + CHECK_TIME)
        });
        Some(slowest.fold(0.0, f64::max))
    }

    /// Share of the cells that the cloud held before the change through which too few frames have looked
    /// since: no map can know that they are empty.
    fn unseen(&self) -> Option<f64> {
        let before = self.checks.iter().filter(|check| check.time < self.change.times[0]);
        let held: BTreeSet<Cell> = before.flat_map(|check| check.cells[0][0].iter().copied()).collect();
        let is_unseen = |cell: &&Cell| self.freed.get(*cell).is_none_or(|looks| looks.known.is_none());
        (!held.is_empty()).then(|| held.iter().filter(is_unseen).count() as f64 / held.len() as f64)
    }

    /// The most that was held while the thing stood at its old place.
    fn held_before(&self, held: impl Fn(&Check) -> f64) -> f64 {
        let before = self.checks.iter().filter(|check| check.time < self.change.times[0]);
        before.map(held).fold(0.0, f64::max)
    }

    /// Time from the first view of a place until a condition holds to the end; infinite when it never does.
    fn time(&self, place: usize, is_asked: bool, holds: impl Fn(&Check) -> bool) -> Option<f64> {
        let looked = self.looked[place].filter(|_| is_asked)?;
        let after = || self.checks.iter().filter(|check| check.time >= looked);
        let last_wrong = after().filter(|check| !holds(check)).map(|check| check.time).last();
        let settled = after().find(|check| last_wrong.is_none_or(|last| check.time > last));
        Some(settled.map_or(f64::INFINITY, |check| check.time - looked))
    }
}

/// All cells whose centres lie in a box, or that touch it.
fn cells_of(place: &OrientedBox) -> BTreeMap<Cell, Looks> {
    let reach = 0.5 * place.lengths().map(|length| length * length).iter().sum::<f64>().sqrt();
    let [low, high] = [-reach, reach].map(|reach| cell_of(place.center().map(|c| c + reach)));
    let around = place.with_rim(HALF_DIAGONAL).unwrap_or(*place);
    let axis = |axis: usize| low[axis]..=high[axis];
    let cells = axis(0).flat_map(|x| axis(1).flat_map(move |y| axis(2).map(move |z| [x, y, z])));
    cells.filter(|&cell| around.contains(middle(cell))).map(|cell| (cell, Looks::default())).collect()
}

fn cell_of(point: [f64; 3]) -> Cell {
    point.map(|c| (c / CELL).floor() as i32)
}

fn middle(cell: Cell) -> [f64; 3] {
    cell.map(|c| (f64::from(c) + 0.5) * CELL)
}

/// Whether the ray through a cell's middle goes on behind the cell to something that the sensor reads.
fn looks_through(cell: Cell, frame: &SimulatedFrame) -> bool {
    let place = frame.world_from_camera.inverse().transform_point(middle(cell));
    frame.looks_through(place, &(0.5..4.0), HALF_DIAGONAL)
}

/// The cells with points in a box, without its lowest part.
fn cells_in<'a>(place: &OrientedBox, points: impl Iterator<Item = &'a Point>) -> BTreeSet<Cell> {
    let foot = ABOVE_FLOOR - 0.5 * place.lengths()[2];
    let box_from_world = place.world_from_box().inverse();
    let inside = points.filter(|point| {
        let point = point.map(f64::from);
        place.contains(point) && box_from_world.transform_point(point)[2] > foot
    });
    inside.map(|point| cell_of(point.map(f64::from))).collect()
}

/// How many cells, or a neighbour of each, are held: a surface on the border of two cells is in either.
fn covered(cells: &BTreeSet<Cell>, held: &BTreeSet<Cell>) -> usize {
    let is_held = |cell: &&Cell| {
        (0..27).any(|step| {
            let [x, y, z] = [step % 3, step / 3 % 3, step / 9].map(|step| step - 1);
            held.contains(&[cell[0] + x, cell[1] + y, cell[2] + z])
        })
    };
    cells.iter().filter(is_held).count()
}

/// Whether half of a box is in view, within range and not occluded.
fn is_looked_at(place: &OrientedBox, frame: &SimulatedFrame) -> bool {
    let camera_from_world = frame.world_from_camera.inverse();
    let camera = frame.frame.camera();
    let half = place.lengths().map(|length| 0.4 * length);
    let points = (0..27_u8).map(|k| {
        let [i, j, k] = [k % 3, k / 3 % 3, k / 9].map(|step| f64::from(step) - 1.0);
        place.world_from_box().transform_point([i * half[0], j * half[1], k * half[2]])
    });
    let seen = points.filter(|&point| {
        let point = camera_from_world.transform_point(point);
        let pixel = camera.project(point).filter(|&pixel| camera.sees(pixel));
        pixel.is_some_and(|[u, v]| {
            let depth = frame.true_depth.at(u.round() as usize, v.round() as usize);
            (0.5..4.0).contains(&point[2]) && f64::from(depth) > point[2] - 0.3
        })
    });
    seen.count() > 13
}

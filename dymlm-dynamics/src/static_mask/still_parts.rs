use std::ops::Range;

use dymlm_core::{Frame, Pose, SensorModel};

use crate::PastViews;
use crate::block_depths::BlockDepths;
use crate::past_views::WATCHED;

/// Least depth of a crease between two parts, measured from the chord over it, metres; a reading's noise
/// comes on top. A lower value cuts a body into pieces too small to be judged, a higher one joins thighs with
/// the seat below them (`a_seat_is_static_while_who_sits_on_it_sways`).
const CREASE_DEPTH: f32 = 0.008;
/// Half the length of that chord, metres: about the radius of a limb. A lower value misses round creases, a
/// higher one takes the gap between two arms for a crease.
const CREASE_REACH: f64 = 0.04;
/// Largest change of depth between neighbouring blocks of a part, in units of their distance on a surface
/// that faces the camera: as for a silhouette. A lower value cuts slanted surfaces apart, a higher one joins
/// body and armrest.
const SLOPE: f64 = 3.0;
/// Largest share of a still part's blocks that may seem to have moved: those at its rim. A higher value takes
/// legs that sway parallel to the image for still (residue), a lower one loses chairs that a moving camera
/// sees (completeness near people).
const MAX_OFF: f32 = 0.25;
/// Least blocks of a part that is judged. A lower value releases scraps of clothes, a higher one loses the
/// legs of chairs.
const MIN_BLOCKS: u32 = 12;
/// Least area that must have moved for the still parts to be released, as a share of the still parts' area. A
/// higher value loses the chair of somebody seen from behind, of whom little is visible; a lower one releases
/// a body of which only a hand moves.
const MIN_MOVED: f32 = 0.1;

/// The parts of a silhouette, some of which may have been still while others moved: the chair on which
/// somebody sits, the desk that an arm touches.
///
/// No step in depth separates a chair from the person on it. But there is a crease where two bodies meet, and
/// the person moves while the chair does not. So surfaces are cut along creases (after the local convexity of
/// Stein et al. 2014, "Object partitioning using local convexity"), and each part is compared with the
/// readings of [past views](PastViews) at its place. As long as nothing has moved, all parts are the mover's.
///
/// Works on blocks of pixels: O(blocks times views).
#[derive(Debug, Clone, Default)]
pub(super) struct StillParts {
    blocks: BlockDepths,
    /// The assignment of each block.
    cells: Vec<Cell>,
    parts: Vec<Part>,
    front: Vec<usize>,
    next_front: Vec<usize>,
}

/// What a block belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cell {
    /// Of the mover, and not yet assigned to a part.
    Free,
    /// On a crease, or not of the mover: its middle is outside the silhouette or has no depth.
    Crease,
    Part(u32),
    /// On the crease beside a part.
    Beside(u32),
}

#[derive(Debug, Clone, Copy, Default)]
struct Part {
    blocks: u32,
    /// Blocks that could be compared with the present view, and those that differ from it.
    seen: u32,
    off: u32,
    /// Whether a view has shown that the part has moved; the time over which no view has, seconds.
    has_moved: bool,
    watched: f64,
    /// Whether further views cannot change the result.
    is_settled: bool,
}

impl Part {
    fn is_still(&self) -> bool {
        !self.has_moved && self.watched >= WATCHED
    }
}

/// What is known of the pixels of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stillness {
    /// The pixels have been still while the mover moved.
    Still,
    /// The pixels are on a crease between a still part and the mover, and may belong to either.
    Doubtful,
}

/// A frame, and the past views with which it is compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ComparedFrame<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) world_from_camera: &'a Pose,
    pub(crate) past: &'a PastViews,
    pub(crate) sensor: &'a SensorModel,
}

impl StillParts {
    /// Cuts those pixels of a window that are `inside` into parts, and judges the parts. Returns false when
    /// none is still.
    pub(super) fn find(
        &mut self,
        compared: &ComparedFrame<'_>,
        window: [Range<usize>; 2],
        is_inside: impl Fn(usize, usize) -> bool,
    ) -> bool {
        let now = compared.frame.timestamp();
        if compared.past.iter().all(|view| view.age(now) < WATCHED) {
            return false;
        }
        let camera = compared.frame.camera();
        self.blocks.fill(compared.frame.depth(), camera.size_scale(), compared.sensor, window, is_inside);
        self.find_creases(compared);
        let slope = (SLOPE * self.blocks.side() as f64 / camera.fx().abs()) as f32;
        let goes_on = |a: f32, b: f32| (a - b).abs() <= slope * a + 2.0 * compared.sensor.sigma(a);
        self.part(goes_on);
        self.compare(compared);
        let any = self.has_still_parts();
        if any {
            self.share_creases(goes_on);
        }
        any
    }

    /// The blocks of still parts and of the creases beside them, as columns and rows of pixels.
    pub(super) fn released(&self) -> impl Iterator<Item = ([Range<usize>; 2], Stillness)> {
        let is_still = |part: u32| self.parts.get(part as usize).is_some_and(Part::is_still);
        self.cells.iter().enumerate().filter_map(move |(block, &cell)| {
            let stillness = match cell {
                Cell::Part(part) if is_still(part) => Stillness::Still,
                Cell::Beside(part) if is_still(part) => Stillness::Doubtful,
                _ => return None,
            };
            Some((self.blocks.pixels(block), stillness))
        })
    }

    fn find_creases(&mut self, compared: &ComparedFrame<'_>) {
        let reach = CREASE_REACH * compared.frame.camera().fx().abs() / self.blocks.side() as f64;
        self.cells.clear();
        for (block, &z) in self.blocks.depths().iter().enumerate() {
            let cell = if z > 0.0 {
                // At a crease the surface on two opposite sides is nearer.
                let steps = (reach / f64::from(z)).round().max(1.0) as usize;
                let limit = z - CREASE_DEPTH - compared.sensor.sigma(z);
                let is_crease = self.blocks.opposite(block, steps).any(|[a, b]| 0.5 * (a + b) < limit);
                if is_crease { Cell::Crease } else { Cell::Free }
            } else {
                Cell::Crease
            };
            self.cells.push(cell);
        }
    }

    /// Joins blocks that no crease and no step in depth separates.
    fn part(&mut self, goes_on: impl Fn(f32, f32) -> bool) {
        self.parts.clear();
        let depths = self.blocks.depths();
        for start in 0..self.cells.len() {
            if self.cells[start] != Cell::Free {
                continue;
            }
            let own = Cell::Part(self.parts.len() as u32);
            let mut part = Part::default();
            self.cells[start] = own;
            self.front.clear();
            self.front.push(start);
            while let Some(block) = self.front.pop() {
                part.blocks += 1;
                for neighbour in self.blocks.neighbours(block) {
                    if self.cells[neighbour] == Cell::Free && goes_on(depths[block], depths[neighbour]) {
                        self.cells[neighbour] = own;
                        self.front.push(neighbour);
                    }
                }
            }
            self.parts.push(part);
        }
    }

    /// Compares each part with the readings of past views at its place, until one view shows that it has
    /// moved. A view that sees less than half of a part does not count.
    fn compare(&mut self, compared: &ComparedFrame<'_>) {
        let camera = compared.frame.camera();
        for part in &mut self.parts {
            // Small parts are not judged.
            part.is_settled = part.blocks < MIN_BLOCKS;
        }
        for view in compared.past.iter() {
            let view_from_camera = view.view_from(compared.world_from_camera);
            for (block, cell) in self.cells.iter().enumerate() {
                let &Cell::Part(part) = cell else { continue };
                let part = &mut self.parts[part as usize];
                if part.is_settled {
                    continue;
                }
                let z = self.blocks.depths()[block];
                let place = camera.back_project(self.blocks.center(block), z.into());
                let place = view_from_camera.transform_point(place);
                let Some(has_moved) = view.has_moved(place, compared.sensor) else { continue };
                part.seen += 1;
                part.off += u32::from(has_moved);
            }
            for part in &mut self.parts {
                let (seen, off) = (std::mem::take(&mut part.seen), std::mem::take(&mut part.off));
                if seen > 0 && 2 * seen >= part.blocks {
                    part.has_moved = off as f32 > MAX_OFF * seen as f32;
                    part.is_settled |= part.has_moved;
                    part.watched = part.watched.max(view.age(compared.frame.timestamp()));
                }
            }
        }
    }

    /// Whether some parts are still and enough of the other parts have moved.
    fn has_still_parts(&self) -> bool {
        let blocks = |chosen: fn(&Part) -> bool| {
            self.parts.iter().filter(|part| chosen(part)).map(|part| part.blocks).sum::<u32>() as f32
        };
        let still = blocks(Part::is_still);
        still > 0.0 && blocks(|part| part.has_moved) >= MIN_MOVED * still
    }

    /// Assigns the blocks of creases to the parts beside them; parts that are not still come first.
    fn share_creases(&mut self, goes_on: impl Fn(f32, f32) -> bool) {
        let depths = self.blocks.depths();
        self.front.clear();
        for is_still in [false, true] {
            let of_parts = self.cells.iter().enumerate().filter_map(|(block, cell)| match cell {
                Cell::Part(part) if self.parts[*part as usize].is_still() == is_still => Some(block),
                _ => None,
            });
            self.front.extend(of_parts);
        }
        while !self.front.is_empty() {
            self.next_front.clear();
            for &block in &self.front {
                let (Cell::Part(part) | Cell::Beside(part)) = self.cells[block] else { continue };
                for neighbour in self.blocks.neighbours(block) {
                    let has_depth = depths[neighbour] > 0.0;
                    let joins = !has_depth || goes_on(depths[block], depths[neighbour]);
                    if self.cells[neighbour] == Cell::Crease && joins {
                        self.cells[neighbour] = Cell::Beside(part);
                        // The search does not go on from a block without depth.
                        if has_depth {
                            self.next_front.push(neighbour);
                        }
                    }
                }
            }
            std::mem::swap(&mut self.front, &mut self.next_front);
        }
    }
}

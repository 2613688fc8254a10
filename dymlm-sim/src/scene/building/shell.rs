use parry3d::math::{Pose3, Rot3, Vec3};

use super::layout::{CORRIDOR, Layout, RISE, SIDES, WALL};
use crate::scene::builder::Builder;
use crate::scene::palette::{CARPET, PLASTER};
use crate::scene::{Material, Shape};

/// Width and height of doorways, metres.
const DOOR: [f32; 2] = [0.95, 2.05];
/// Thickness of floors and of ceilings, metres: a ceiling is so thick that its end closes the corridor where
/// the next ceiling is higher.
const FLOOR: f32 = 0.1;
const CEILING: f32 = 0.5;

/// Surfaces that continue only inside walls must not form one face: floors stick out this far beyond walls,
/// and the corridor's ends stand this far before those of the rooms, metres.
const STEP: f32 = 0.03;

/// Floors, ceilings, walls with doorways and the ramp: one thing of many cuboids that touch. One floor runs
/// through the doors of all rooms of a level; each room has its own walls and ceiling.
pub(super) fn build(b: &mut Builder, layout: &Layout) {
    b.thing(None, [0.0; 3], 0.0);
    let far = 0.5 * CORRIDOR + 2.0 * WALL + layout.depth;
    let inner = [-0.5 * CORRIDOR, 0.5 * CORRIDOR];
    let top = |floor: f32| floor + layout.height;
    for level in layout.columns.chunk_by(|a, b| a.floor == b.floor) {
        let (Some(first), Some(last)) = (level.first(), level.last()) else { continue };
        let x = [first.span[0] - WALL - STEP, last.span[1] + WALL + STEP];
        // The corridor's floor and ceiling end at the ramp.
        let z = first.floor;
        slab(b, [x, [-far - STEP, far + STEP], [z - FLOOR, z]], CARPET);
        slab(b, [[x[0] + STEP, x[1] - STEP], inner, [top(z), top(z) + CEILING]], PLASTER);
    }
    for column in &layout.columns {
        let z = [column.floor, top(column.floor)];
        let [begin, end] = column.span;
        for side in SIDES {
            let across = |from: f32, to: f32| if side > 0.0 { [from, to] } else { [-to, -from] };
            let corridor = across(0.5 * CORRIDOR, 0.5 * CORRIDOR + WALL);
            if column.has_room(side) {
                let room = across(0.5 * CORRIDOR + WALL, far - WALL);
                slab(b, [column.span, room, [z[1], z[1] + CEILING]], PLASTER);
                with_doorway(b, 0, [column.span, corridor, z], column.door);
                slab(b, [column.span, across(far - WALL, far), z], PLASTER);
            } else {
                slab(b, [column.span, corridor, z], PLASTER);
            }
            // The wall before the column, and the wall after it if no column follows directly.
            let beyond = (column.after.is_none(), [end, end + WALL]);
            for (_, x) in [(true, [begin - WALL, begin]), beyond].into_iter().filter(|wall| wall.0) {
                let is_joined = x[0] < begin && column.before.is_some() && side > 0.0;
                let door = side * (layout.middle_of_rooms() + layout.hub);
                let wall = [x, across(0.5 * CORRIDOR, far), z];
                if is_joined { with_doorway(b, 1, wall, door) } else { slab(b, wall, PLASTER) }
            }
        }
    }
    if let [first, .., last] = &layout.columns[..] {
        let ends = [(first.span[0], first.floor), (last.span[1], last.floor)];
        for (x, floor) in ends {
            slab(b, [[x - WALL - STEP, x + WALL + STEP], inner, [floor, top(floor)]], PLASTER);
        }
    }
    if let Some(ramp) = &layout.ramp {
        let z = [0.0, top(RISE)];
        for side in SIDES {
            let wall = 0.5 * side * (CORRIDOR + WALL);
            slab(b, [ramp.span, [wall - 0.5 * WALL, wall + 0.5 * WALL], z], PLASTER);
        }
        slab(b, [ramp.span, inner, [z[1], z[1] + CEILING]], PLASTER);
        let [low, high] = ramp.ends();
        let way = high - low;
        let along = Rot3::from_rotation_y(-way.z.atan2(way.x));
        let middle = 0.5 * (low + high) + along * Vec3::new(0.0, 0.0, -0.5 * FLOOR);
        let half = Vec3::new(0.5 * way.length(), 0.5 * CORRIDOR, 0.5 * FLOOR);
        b.part(Shape::cuboid(half), Pose3::from_parts(middle, along), CARPET);
    }
}

/// A wall along `axis` (0 or 1) with a doorway whose middle is at `door` on that axis.
fn with_doorway(b: &mut Builder, axis: usize, wall: [[f32; 2]; 3], door: f32) {
    let [left, right] = [door - 0.5 * DOOR[0], door + 0.5 * DOOR[0]];
    let mut piece = |along: [f32; 2], from: f32| {
        let mut piece = wall;
        piece[axis] = along;
        piece[2][0] += from;
        slab(b, piece, PLASTER);
    };
    piece([wall[axis][0], left], 0.0);
    piece([left, right], DOOR[1]);
    piece([right, wall[axis][1]], 0.0);
}

/// A cuboid between bounds along x, y, z.
fn slab(b: &mut Builder, bounds: [[f32; 2]; 3], material: Material) {
    let center = bounds.map(|[low, high]| 0.5 * (low + high));
    b.cuboid(center, bounds.map(|[low, high]| high - low), material);
}

use parry3d::math::Vec3;

use crate::scene::Part;

/// Largest thickness of a thin thing, metres.
const THIN: f32 = 0.06;
/// How far space must be free on both sides of a thin thing, metres: a score asks for points within 2 cm of it, and
/// with less room would find those of what is behind it.
const CLEAR: f32 = 0.02;
/// Distance between the places at which space is tested, metres.
const STEP: f32 = 0.005;
/// Just outside a surface, metres.
const OUTSIDE: f32 = 1e-3;
/// Where a part is tested across its two greater extents, as shares of these: a leg or a thing on a table top is
/// at some of these places only.
const PLACES: [f32; 3] = [-0.55, 0.05, 0.65];

/// The parts that have free space on both of their large sides, with at most 6 cm of bodies in between: table
/// tops, screens, legs, slats. Floors, carpets and what is flat on a wall or on something thick have another body
/// behind them.
pub(super) fn thin_parts(parts: &[Part]) -> Vec<Part> {
    let is_thin = |part: &&Part| {
        let near = near(part, parts);
        let open = places(part).filter(|&place| is_open(part, place, &near)).count();
        2 * open > PLACES.len() * PLACES.len()
    };
    let narrow = parts.iter().filter(|part| {
        let thickness = 2.0 * part.shape.half_extents().min_element();
        thickness > 0.0 && thickness <= THIN
    });
    narrow.filter(is_thin).cloned().collect()
}

/// The axis along which a part is thinnest.
fn thinnest_axis(part: &Part) -> usize {
    let half = part.shape.half_extents();
    (0..3).min_by(|&a, &b| half[a].total_cmp(&half[b])).unwrap_or(0)
}

/// The other parts that may reach into the space beside a part.
fn near<'a>(part: &Part, parts: &'a [Part]) -> Vec<&'a Part> {
    let reach = part.shape.half_extents().length() + THIN + CLEAR;
    let center = part.scene_from_part.translation;
    let is_near = |other: &&Part| {
        let half = other.shape.half_extents();
        half.min_element() > 0.0
            && !std::ptr::eq(*other, part)
            && other.shape.reaches(other.scene_from_part.inverse_transform_point(center), reach)
    };
    parts.iter().filter(is_near).collect()
}

/// Places in the middle plane of a part, in its own frame.
fn places(part: &Part) -> impl Iterator<Item = Vec3> {
    let (half, axis) = (part.shape.half_extents(), thinnest_axis(part));
    PLACES.into_iter().flat_map(move |along_u| {
        PLACES.into_iter().map(move |along_v| {
            let mut place = Vec3::ZERO;
            place[(axis + 1) % 3] = along_u * half[(axis + 1) % 3];
            place[(axis + 2) % 3] = along_v * half[(axis + 2) % 3];
            place
        })
    })
}

/// Whether the line through a place, across the part, comes out into free space on both sides before it has been
/// in bodies for more than [`THIN`].
fn is_open(part: &Part, place: Vec3, near: &[&Part]) -> bool {
    let axis = thinnest_axis(part);
    let half = part.shape.half_extents()[axis];
    let is_free = |beyond: f32, side: f32| {
        let mut point = place;
        point[axis] = side * (half + OUTSIDE + beyond);
        let in_scene = part.scene_from_part.transform_point(point);
        !near
            .iter()
            .any(|other| other.shape.reaches(other.scene_from_part.inverse_transform_point(in_scene), 0.0))
    };
    let steps = |length: f32| (0..=(length / STEP) as u16).map(|step| STEP * f32::from(step));
    // How much of other bodies is on one side.
    let cover = |side: f32| steps(THIN).find(|&beyond| is_free(beyond, side));
    let Some(covers) = cover(1.0).zip(cover(-1.0)) else { return false };
    2.0 * half + covers.0 + covers.1 <= THIN
        && [(1.0, covers.0), (-1.0, covers.1)]
            .into_iter()
            .all(|(side, cover)| steps(CLEAR).all(|further| is_free(cover + further, side)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Cast, Scene, Shape};
    use crate::{Activity, Sequence, SequenceConfig};

    /// Parts of a thing by their full lengths, in the order of the scene.
    fn of_size(parts: &[Part], size: [f32; 3]) -> usize {
        let is_of_size = |part: &&Part| {
            let lengths = 2.0 * part.shape.half_extents();
            matches!(part.shape, Shape::Cuboid(_)) && (lengths - Vec3::from(size)).abs().max_element() < 1e-4
        };
        parts.iter().filter(is_of_size).count()
    }

    #[test]
    fn in_the_office_what_is_flat_on_something_is_not_thin() {
        let parts = Scene::office(&Cast::usual(Activity::Walking, 0)).static_parts;
        let thin = thin_parts(&parts);
        let carpet = [5.98, 6.43, 0.01];
        let (door, poster, drawer) = ([0.9, 0.06, 2.06], [0.7, 0.02, 0.9], [0.74, 0.02, 0.31]);
        for size in [carpet, door, poster, drawer] {
            assert!(of_size(&parts, size) > 0 && of_size(&thin, size) == 0, "{size:?}");
        }
        let (desk, partition, board) = ([1.9, 0.75, 0.03], [2.3, 0.05, 1.38], [1.2, 0.34, 0.03]);
        let (screen, housing, armrest) = ([0.51, 0.012, 0.30], [0.54, 0.04, 0.33], [0.05, 0.26, 0.03]);
        for size in [desk, partition, board, screen, housing, armrest] {
            let (found, all) = (of_size(&thin, size), of_size(&parts, size));
            assert!(all > 0 && found == all, "{size:?}: {found} of {all}");
        }
        // The legs of chairs, which are rods; a teddy's limbs are flush with its body.
        let legs = |parts: &[Part]| {
            let is_leg = |part: &&Part| (part.shape.half_extents().x - 0.022).abs() < 1e-4;
            parts.iter().filter(|part| matches!(part.shape, Shape::Capsule(_))).filter(is_leg).count()
        };
        assert_eq!((legs(&parts), legs(&thin)), (15, 15));
    }

    #[test]
    fn in_random_rooms_legs_and_table_tops_are_thin_and_floors_are_not() {
        let mut legs = 0;
        for seed in 0..12 {
            let sequence = Sequence::new(&SequenceConfig::random_room(seed)).unwrap();
            let parts = &sequence.scene().static_parts;
            let thin = thin_parts(parts);
            let lengths = |part: &Part| 2.0 * part.shape.half_extents();
            // Nothing lies on floors and walls.
            assert!(thin.iter().all(|part| lengths(part).max_element() < 3.0), "seed {seed}");
            let floors = parts.iter().filter(|part| (lengths(part).z - 0.01).abs() < 1e-4);
            assert!(floors.filter(|part| lengths(part).x > 3.0).count() == 1, "seed {seed}");
            // Legs of wooden chairs and of tables; the tops of these, 3.5 cm thick.
            for leg in [[0.04, 0.04, 0.43], [0.04, 0.04, 0.86]] {
                assert_eq!(of_size(&thin, leg), of_size(parts, leg), "seed {seed}");
                legs += of_size(&thin, leg);
            }
            let is_top = |part: &&Part| {
                let size = lengths(part);
                matches!(part.shape, Shape::Cuboid(_)) && (size.z - 0.035).abs() < 1e-4 && size.x > 0.5
            };
            let tops = |parts: &[Part]| parts.iter().filter(is_top).count();
            assert_eq!(tops(&thin), tops(parts), "seed {seed}");
        }
        assert!(legs > 20, "{legs}");
    }
}

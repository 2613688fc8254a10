//! Questions to the static cloud: against all its points, on surfaces whose truth is known, after rigid
//! motions, and where there is nothing to find.

use dymlm_cloud::{CloudMap, CloudMapConfig, Selection, StaticPoint};
use dymlm_core::vector3::{along, difference, dot, norm, unit};
use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Point, Pose, SensorModel, SplitMix64};
use dymlm_geometry::OrientedBox;
use dymlm_test_support::{Cuboid, Rectangle, World, cases};
use proptest::prelude::*;

fn camera() -> PinholeCamera {
    PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap()
}

/// A floor, a wall and a box that is turned, and something that stands there for one frame of six.
fn room(with_visitor: bool) -> World {
    let turned = Pose::new([0.3, 2.0, 0.2], [0.0, 0.0, 0.38, 0.925]).unwrap();
    let mut cuboids = vec![Cuboid { world_from_cuboid: turned, lengths: [0.5, 0.4, 0.4] }];
    if with_visitor {
        let place = Pose::new([-0.5, 1.6, 0.9], [0.0, 0.0, 0.0, 1.0]).unwrap();
        cuboids.push(Cuboid { world_from_cuboid: place, lengths: [0.4, 0.3, 1.0] });
    }
    let rectangles =
        vec![Rectangle::level([0.0; 3], 3.0, 3.0), Rectangle::upright([0.0, 3.0, 1.0], 3.0, 1.0)];
    World { rectangles, cuboids, ..World::default() }
}

/// Looks along y and a little down from 1.2 m, from the side at each step.
fn view(step: u32) -> Pose {
    let rows = [[1.0, 0.0, 0.0], [0.0, -0.3, 0.954], [0.0, -0.954, -0.3]];
    Pose::from_rotation_matrix(rows, [0.1 * f64::from(step) - 0.3, 0.0, 1.2]).unwrap()
}

/// The room as it was mapped, in a world that `moved` takes the room's to.
fn mapped(moved: &Pose) -> CloudMap {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    for step in 0..6 {
        let frame = room(step == 2).frame(camera(), &view(step), u64::from(step));
        map.insert(&frame, None, &(*moved * view(step))).unwrap();
    }
    map
}

fn random_place(random: &mut SplitMix64) -> [f64; 3] {
    let [x, y, z] = [(); 3].map(|()| random.fraction());
    [4.0 * x - 2.0, 4.0 * y - 0.5, 3.0 * z - 0.5]
}

fn unit_quaternion(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    q.map(|c| c / length)
}

fn distance(a: [f64; 3], b: Point) -> f64 {
    norm(difference(b.map(f64::from), a))
}

fn first_by<T: Copy>(items: &[T], measure: impl Fn(&T) -> Option<f64>) -> Option<T> {
    let measured = items.iter().filter_map(|item| Some((measure(item)?, item)));
    measured.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, item)| *item)
}

#[test]
fn the_nearest_point_is_the_one_that_a_look_at_all_finds() {
    let map = mapped(&Pose::identity());
    let cloud = map.point_cloud(Selection::Static);
    let points = map.static_points();
    let mut random = SplitMix64::new(3);
    let mut answers = 0;
    for radius in [0.0, 0.03, 0.2, 1.0, f64::INFINITY] {
        for _ in 0..60 {
            let mut place = random_place(&mut random);
            if radius == f64::INFINITY && random.fraction() < 0.3 {
                place = place.map(|c| 1e4 * c);
            }
            let expected = first_by(cloud.points(), |&point| {
                let away = distance(place, point);
                (away * away <= radius * radius).then_some(away * away)
            });
            let found = points.nearest(place, radius).map(|point| point.position);
            assert_eq!(found.map(|p| distance(place, p)), expected.map(|p| distance(place, p)));
            answers += usize::from(found.is_some());
        }
    }
    assert!(answers > 100, "{answers}");
    // Where one is asked for itself.
    for &point in cloud.points().iter().step_by(97) {
        assert_eq!(points.nearest(point.map(f64::from), 0.0).map(|found| found.position), Some(point));
    }
}

#[test]
fn a_box_holds_the_points_that_lie_in_it_in_the_order_of_the_cloud() {
    let map = mapped(&Pose::identity());
    let cloud = map.point_cloud(Selection::Static);
    let points = map.static_points();
    let (mut random, mut found, mut total) = (SplitMix64::new(5), Vec::new(), 0);
    for size in [0.05, 0.4, 1.5, 8.0, 1e6] {
        for _ in 0..20 {
            let turn = unit_quaternion([(); 4].map(|()| random.fraction() - 0.5));
            let pose = Pose::new(random_place(&mut random), turn).unwrap();
            let region = OrientedBox::new(pose, [(); 3].map(|()| size * random.fraction())).unwrap();
            points.in_box(&region, &mut found);
            let inside = cloud.points().iter().copied().filter(|p| region.contains(p.map(f64::from)));
            assert!(found.iter().map(|point| point.position).eq(inside));
            total += found.len();
        }
    }
    assert!(total > 10_000, "{total}");
}

#[test]
fn a_ray_meets_the_first_point_beside_it() {
    let map = mapped(&Pose::identity());
    let cloud = map.point_cloud(Selection::Static);
    let points = map.static_points();
    let (mut random, mut hits) = (SplitMix64::new(7), 0);
    for case in 0..200 {
        let (mut origin, target) = (random_place(&mut random), random_place(&mut random));
        let direction = difference(target, origin);
        let radius = [0.0, 0.015, 0.05, 0.3][case % 4];
        let max_range = [f64::INFINITY, 1.0, 3.0][case % 3];
        let ahead = unit(direction).unwrap();
        if case % 5 == 0 && max_range == f64::INFINITY {
            origin = along(origin, -100.0, ahead);
        }
        let along_ray = |&point: &Point| {
            let offset = difference(point.map(f64::from), origin);
            let distance = dot(offset, ahead);
            let beside = norm(difference(offset, ahead.map(|c| c * distance)));
            ((0.0..=max_range).contains(&distance) && beside <= radius).then_some(distance)
        };
        let expected = first_by(cloud.points(), along_ray).and_then(|point| along_ray(&point));
        let length = [3.0, 1e-200, 1e200][case % 3];
        let found = points.cast_ray(origin, direction.map(|c| length * c), max_range, radius);
        match (found.map(|hit| hit.distance), expected) {
            (Some(found), Some(expected)) => assert!((found - expected).abs() < 1e-9, "{case}"),
            (found, expected) => assert_eq!(found, expected, "{case}"),
        }
        hits += usize::from(found.is_some());
    }
    assert!(hits > 40, "{hits}");
}

/// Regression: a ray as wide as a hall was followed in steps of eight voxels through all that is as near.
#[test]
fn a_wide_ray_is_followed_no_farther_than_the_map() {
    let map = mapped(&Pose::identity());
    let points = map.static_points();
    let start = std::time::Instant::now();
    // The map lies behind the first ray.
    assert_eq!(points.cast_ray([0.0, 9.0, 0.0], [0.0, 1.0, 0.0], f64::INFINITY, 1e4), None);
    assert!(points.cast_ray([0.0, -9.0, 0.0], [0.0, 1.0, 0.0], f64::INFINITY, 1e4).is_some());
    assert!(start.elapsed().as_secs_f64() < 1.0, "{:?}", start.elapsed());
}

#[test]
fn normals_are_those_of_the_surfaces_and_face_the_camera() {
    let (map, truth) = (mapped(&Pose::identity()), room(false));
    let points = map.static_points();
    let cuboid = truth.cuboids[0];
    for (radius, allowed) in [(0.04, [10.0, 24.0]), (0.08, [1.8, 4.5]), (0.15, [0.6, 1.5])] {
        let (mut asked, mut errors, mut turned, mut lost) = (0, Vec::new(), 0, 0);
        for &point in map_points(&map).iter().step_by(7) {
            let place = point.map(f64::from);
            let in_box = cuboid.world_from_cuboid.inverse().transform_point(place);
            let away_from = |half: [f64; 2]| (0..2).any(|axis| in_box[axis].abs() > half[axis] + radius);
            let is_on_top = (0..2).all(|axis| in_box[axis].abs() < [0.25, 0.2][axis] - radius);
            // Away from where surfaces meet.
            let is_floor = away_from([0.25, 0.2]) && place[2].abs() < 0.03 && place[1] < 3.0 - radius;
            let expected = if is_floor || (is_on_top && (place[2] - 0.4).abs() < 0.03) {
                [0.0, 0.0, 1.0]
            } else if (place[1] - 3.0).abs() < 0.05 && place[2] > radius {
                [0.0, -1.0, 0.0]
            } else {
                continue;
            };
            asked += 1;
            let Some(normal) = points.normal_at(point, radius) else { continue };
            let cosine = dot(normal.direction, expected);
            errors.push(cosine.abs().min(1.0).acos().to_degrees());
            turned += usize::from(normal.is_oriented && cosine < 0.0);
            lost += usize::from(!normal.is_oriented);
        }
        errors.sort_by(f64::total_cmp);
        let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
        let known = errors.len();
        eprintln!(
            "{radius}: {asked} asked, {known} known, {turned} turned, {lost} lost, {median:.2} {most:.2} degrees"
        );
        assert!(asked > 500 && known * 100 > 95 * asked && turned == 0 && lost * 100 < 3 * known);
        assert!(median < allowed[0] && most < allowed[1]);
    }
}

fn map_points(map: &CloudMap) -> Vec<Point> {
    map.point_cloud(Selection::Static).points().to_vec()
}

/// A frame whose readings lie on one line of pixels.
fn line_of_readings(time: f64, is_read: impl Fn(usize, usize) -> bool) -> Frame {
    let pixels = (0..120).flat_map(|v| (0..160).map(move |u| (u, v)));
    let depth: Vec<f32> = pixels.clone().map(|(u, v)| if is_read(u, v) { 1.0 } else { 0.0 }).collect();
    let colors = pixels.map(|(u, v)| [u as u8, v as u8, 9]).collect();
    let color = ColorImage::new(160, 120, colors).unwrap();
    Frame::new(time, camera(), DepthImage::new(160, 120, depth).unwrap(), Some(color)).unwrap()
}

#[test]
fn a_line_and_a_few_points_have_no_normal() {
    let is_line = |_: usize, v: usize| v == 60;
    let is_cross = |u: usize, v: usize| v == 60 || u == 80;
    for (is_read, has_normal) in [(&is_line as &dyn Fn(usize, usize) -> bool, false), (&is_cross, true)] {
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        for time in 0..3 {
            map.insert(&line_of_readings(f64::from(time), is_read), None, &Pose::identity()).unwrap();
        }
        let points = map.static_points();
        let center = points.nearest([0.0, 0.0, 1.0], 0.05).unwrap();
        assert_eq!(points.normal_at(center.position, 0.1).is_some(), has_normal);
        assert_eq!(points.normal_at(center.position, 0.001), None);
    }
}

#[test]
fn points_have_the_colors_of_the_cloud() {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    for time in 0..3 {
        map.insert(&line_of_readings(f64::from(time), |_, _| true), None, &Pose::identity()).unwrap();
    }
    let (cloud, mut found) = (map.point_cloud(Selection::Static), Vec::new());
    map.static_points().in_box(&OrientedBox::between([-9.0; 3], [9.0; 3]).unwrap(), &mut found);
    let colors: Vec<_> = found.iter().filter_map(|point| point.color).collect();
    assert_eq!(Some(colors.as_slice()), cloud.colors());
}

#[test]
fn what_the_evidence_calls_a_ghost_is_not_found() {
    let map = mapped(&Pose::identity());
    let visitor = OrientedBox::between([-0.7, 1.4, 0.5], [-0.3, 1.8, 1.4]).unwrap();
    let held = map.voxels(Selection::All).filter(|voxel| visitor.contains(voxel.position.map(f64::from)));
    assert!(held.count() > 100);
    let (points, mut found) = (map.static_points(), Vec::new());
    points.in_box(&visitor, &mut found);
    assert_eq!(found, []);
    assert_eq!(points.nearest([-0.5, 1.45, 0.9], 0.3), None);
    // The ray goes on to the wall.
    let hit = points.cast_ray([-0.5, 0.0, 0.9], [0.0, 1.0, 0.0], 5.0, 0.03).unwrap();
    assert!((hit.distance - 3.0).abs() < 0.06, "{hit:?}");
}

#[test]
fn where_nothing_is_nothing_is_found() {
    let empty = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    let (full, mut found) = (mapped(&Pose::identity()), vec![]);
    let everything = OrientedBox::between([-1e14; 3], [1e14; 3]).unwrap();
    {
        let points = empty.static_points();
        assert_eq!(points.nearest([0.0; 3], f64::INFINITY), None);
        assert_eq!(points.cast_ray([0.0; 3], [1.0, 0.0, 0.0], f64::INFINITY, 1.0), None);
        assert_eq!(points.normal_at([0.0; 3], f64::MAX), None);
        points.in_box(&everything, &mut found);
        assert_eq!(found, []);
    }
    let all = map_points(&full);
    let points = full.static_points();
    points.in_box(&everything, &mut found);
    assert_eq!(found.len(), all.len());
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for axis in 0..3 {
            let mut place = [0.0, 1.0, 0.5];
            place[axis] = odd;
            assert_eq!(points.nearest(place, 10.0), None);
            assert_eq!(points.cast_ray(place, [0.0, 1.0, 0.0], 10.0, 0.1), None);
            assert_eq!(points.cast_ray([0.0; 3], place, 10.0, 0.1), None);
            assert_eq!(points.normal_at(place.map(|c| c as f32), 0.1), None);
        }
    }
    for radius in [f64::NAN, -1.0] {
        assert_eq!(points.nearest([0.0; 3], radius), None);
        assert_eq!(points.cast_ray([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], 10.0, radius), None);
    }
    assert_eq!(points.cast_ray([0.0; 3], [0.0; 3], 10.0, 0.1), None);
    assert_eq!(points.cast_ray([0.0; 3], [0.0, 1.0, 0.0], f64::NAN, 0.1), None);
    // From as far as numbers go.
    for far in [1e6, 1e15, 1e300] {
        assert!(points.nearest([far; 3], f64::INFINITY).is_some());
        assert_eq!(points.nearest([far; 3], 1.0), None);
        let _ = points.cast_ray([far; 3], [-1.0; 3], f64::INFINITY, 0.1);
        assert_eq!(points.normal_at([far as f32; 3], 0.1), None);
    }
    assert!(points.cast_ray([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], f64::INFINITY, 1e9).is_some());
    for radius in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        assert_eq!(points.normal_at(all[0], radius), None);
    }
    // The map can be asked while somebody has its points.
    assert_eq!((full.len(), full.static_points().nearest([0.0; 3], 0.0)), (all.len(), None));
}

#[test]
fn a_map_that_was_emptied_again_answers_nothing() {
    let mut map = mapped(&Pose::identity());
    assert!(map.static_points().nearest([0.0, 2.0, 0.5], 2.0).is_some());
    map.forget_outside([1e3; 3], 1.0);
    let points = map.static_points();
    assert_eq!(points.nearest([0.0, 2.0, 0.5], f64::INFINITY), None);
    assert_eq!(points.cast_ray([0.0; 3], [0.0, 1.0, 0.0], 5.0, 0.5), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(6)))]

    #[test]
    fn answers_turn_with_the_world(
        turn in prop::array::uniform4(-1.0..1.0_f64),
        shift in prop::array::uniform3(-50.0..50.0_f64),
    ) {
        prop_assume!(turn.iter().map(|c| c * c).sum::<f64>() > 0.1);
        let moved = Pose::new(shift, unit_quaternion(turn)).unwrap();
        let (map, other) = (mapped(&Pose::identity()), mapped(&moved));
        let (points, others) = (map.static_points(), other.static_points());
        let mut random = SplitMix64::new(11);
        let (mut cosines, mut count, mut differences, mut answers) = (0.0, 0.0, 0.0, 0.0);
        for _ in 0..40 {
            let place = random_place(&mut random);
            let pair = [points.nearest(place, 1.0), others.nearest(moved.transform_point(place), 1.0)];
            let [Some(one), Some(two)] = pair else { continue };
            let away = |place, point: StaticPoint| distance(place, point.position);
            let [a, b] = [away(place, one), away(moved.transform_point(place), two)];
            // Voxels lie otherwise, and with them what is noise.
            prop_assert!((a - b).abs() < 0.1, "{a} {b}");
            differences += (a - b).abs();
            answers += 1.0;
            let normals = [points.normal_at(one.position, 0.1), others.normal_at(two.position, 0.1)];
            if let [Some(one), Some(two)] = normals {
                cosines += dot(moved.rotate(one.direction), two.direction).abs();
                count += 1.0;
            }
        }
        prop_assert!(differences / answers < 0.012, "{} m", differences / answers);
        prop_assert!(cosines / count > 0.9, "{} of {count}", cosines / count);
    }
}

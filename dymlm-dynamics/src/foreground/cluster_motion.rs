use dymlm_core::SensorModel;
use dymlm_geometry::{BoxSegmenter, SampleGrid};

use crate::ComparedFrame;
use crate::block_depths::mean_place;
use crate::past_views::{EVENNESS, WATCHED};

/// Least samples of a cluster that is compared. A lower value takes the noise at edges for motion, a higher
/// one leaves the bottles on a table as likely as the person behind it.
const MIN_SAMPLES: usize = 12;
/// Most samples of a cluster that are compared: their mean has a fourteenth of the noise of one.
const MAX_SAMPLES: usize = 200;
/// Mean displacement, in standard deviations, beyond which a cluster has surely moved. A lower value takes
/// errors of the poses for motion
/// (`nothing_is_still_before_something_has_surely_moved_and_four_seconds_were_seen`).
const SURELY: f64 = 3.0;
/// Mean displacement, in standard deviations, beyond which a cluster may have moved. Of a cluster of many
/// samples a deviation is the accuracy of the poses, 4 mm. With more, who sways by a centimetre is still.
const MAYBE: f64 = 1.0;
/// The same for a quarter of a cluster, of which the largest of four counts: one shoulder comes, the other
/// one goes, and the mean of both is where it was. With 1, things on a table do not stay still for long; with
/// 3, who turns in a chair is still (`who_turns_is_not_still_though_the_mean_is`).
const MAYBE_A_QUARTER: f64 = 2.0;

/// Which clusters of a box have stayed where they are, and which have moved, as past views show them.
///
/// What the detector has put its box around moves, if only by a sway; the things before it, on the table at
/// which it sits, do not. And whatever moves in a mover's box is not static, whether it is a leg that a desk
/// parts from its body, a chair that turns, or somebody behind it. A sway of a centimetre is less than the
/// noise and the steps of single readings two metres away, but many times the error of a whole cluster's
/// mean: so means are compared, those of clusters and of their quarters. Costs O(views) for each sample that
/// is compared.
#[derive(Debug, Default)]
pub(super) struct ClusterMotion {
    clusters: Vec<Watched>,
    places: Vec<Place>,
}

/// What past views have shown of a cluster.
#[derive(Debug, Clone, Copy, Default)]
struct Watched {
    /// Samples met so far, and those that are compared.
    samples: usize,
    compared: u32,
    /// The pixel in the middle of the cluster.
    middle: [f32; 2],
    /// How far the present view has read its quarters.
    quarters: [Displacement; 4],
    /// Whether a view has shown that it has surely moved; whether one has shown that it may have.
    has_moved: bool,
    may_have_moved: bool,
    /// Whether a view has read it elsewhere than now, by more than the poses err. Unlike above, a look through
    /// it does not count: a pose that errs by the width of a thin thing looks past it.
    was_elsewhere: bool,
    /// Time over which views have seen the cluster, seconds.
    seen_for: f64,
}

/// How far a view has read a cluster from where it is now.
#[derive(Debug, Clone, Copy, Default)]
struct Displacement {
    /// Samples that the view has read, and those that it has looked through.
    read: u32,
    absent: u32,
    /// Sums over the samples that were read: displacements, metres, and the variances of a reading there.
    sum: f64,
    variance: f64,
}

/// A sample of a cluster that is compared.
#[derive(Debug, Clone, Copy)]
struct Place {
    cluster: usize,
    quarter: usize,
    /// In the camera's frame.
    point: [f64; 3],
}

impl ClusterMotion {
    /// Compares the clusters of a grid with the past views.
    pub(super) fn compare(
        &mut self,
        compared: &ComparedFrame<'_>,
        grid: &SampleGrid,
        segmenter: &BoxSegmenter,
    ) {
        self.clusters.clear();
        self.clusters.extend(segmenter.clusters().iter().map(|cluster| {
            let middle = cluster.bounds(grid).map_or([0.0; 2], |bounds| bounds.center());
            Watched { middle, ..Watched::default() }
        }));
        let now = compared.frame.timestamp();
        let candidates = segmenter.clusters().iter().filter(|cluster| cluster.inside >= MIN_SAMPLES).count();
        if candidates < 2 {
            return;
        }
        self.choose_places(compared, grid, segmenter);
        for view in compared.past.iter() {
            let view_from_camera = view.view_from(compared.world_from_camera);
            for &Place { cluster, quarter, point } in &self.places {
                let point = view_from_camera.transform_point(point);
                let displacement = view.displacement(point, compared.sensor);
                self.clusters[cluster].quarters[quarter].add(displacement, point[2], compared.sensor);
            }
            self.clusters.iter_mut().for_each(|cluster| cluster.end_view(view.age(now), view.misfit()));
        }
    }

    /// Whether a cluster has been still while another one has moved.
    pub(super) fn is_still(&self, cluster: usize) -> bool {
        let is_still = |cluster: &Watched| !cluster.may_have_moved && cluster.seen_for >= WATCHED;
        self.clusters.get(cluster).is_some_and(is_still)
            && self.clusters.iter().any(|cluster| cluster.has_moved)
    }

    /// Whether a past view has read a cluster elsewhere than it is now, by more than the poses err.
    pub(super) fn was_elsewhere(&self, cluster: usize) -> bool {
        self.clusters.get(cluster).is_some_and(|cluster| cluster.was_elsewhere)
    }

    /// Chooses the samples that are compared, evenly spread over each cluster.
    fn choose_places(&mut self, compared: &ComparedFrame<'_>, grid: &SampleGrid, segmenter: &BoxSegmenter) {
        self.places.clear();
        for (sample, cluster) in segmenter.members() {
            let size = segmenter.clusters()[cluster].inside;
            let (sample, watched) = (&grid.samples[sample], &mut self.clusters[cluster]);
            if !sample.is_in_box || size < MIN_SAMPLES {
                continue;
            }
            watched.samples += 1;
            if watched.samples % size.div_ceil(MAX_SAMPLES) != 0 {
                continue;
            }
            let cell = [sample.column, sample.row].map(|c| c as usize * grid.stride);
            let corner = [grid.first[0] + cell[0], grid.first[1] + cell[1]];
            if let Some(point) = mean_place(corner, grid.stride, compared.frame, compared.sensor) {
                watched.compared += 1;
                let [is_right, is_low] = [0, 1].map(|axis| corner[axis] as f32 >= watched.middle[axis]);
                let quarter = 2 * usize::from(is_low) + usize::from(is_right);
                self.places.push(Place { cluster, quarter, point });
            }
        }
    }
}

impl Watched {
    /// Takes in what a view of some age has shown, if it has seen at least half of the cluster.
    fn end_view(&mut self, age: f64, misfit: f64) {
        let quarters = std::mem::take(&mut self.quarters);
        let view = quarters.iter().fold(Displacement::default(), Displacement::joined);
        if view.seen() == 0 || 2 * view.seen() < self.compared {
            return;
        }
        let deviations = view.deviations_or_absent();
        let is_moved = |own: &Displacement| {
            own.seen() >= MIN_SAMPLES as u32 && own.deviations_or_absent() > MAYBE_A_QUARTER
        };
        self.may_have_moved |= deviations > MAYBE || quarters.iter().any(is_moved);
        self.has_moved |= deviations > SURELY;
        self.was_elsewhere |= view.absent <= view.read && view.deviations(EVENNESS.max(misfit)) > SURELY;
        self.seen_for = self.seen_for.max(age);
    }
}

impl Displacement {
    fn add(&mut self, displacement: Option<f64>, z: f64, sensor: &SensorModel) {
        match displacement {
            None => {}
            Some(displacement) if displacement.is_infinite() => self.absent += 1,
            Some(displacement) => {
                self.read += 1;
                self.sum += displacement;
                self.variance += f64::from(sensor.sigma(z as f32)).powi(2);
            }
        }
    }

    /// That of both.
    fn joined(self, other: &Self) -> Self {
        Self {
            read: self.read + other.read,
            absent: self.absent + other.absent,
            sum: self.sum + other.sum,
            variance: self.variance + other.variance,
        }
    }

    /// Samples of which the view can tell.
    fn seen(&self) -> u32 {
        self.read + self.absent
    }

    /// The mean displacement in standard deviations; infinite when the view has looked through most of it.
    fn deviations_or_absent(&self) -> f64 {
        if self.absent > self.read { f64::INFINITY } else { self.deviations(EVENNESS) }
    }

    /// The mean displacement in standard deviations, when places are accurate to `accuracy`, metres.
    fn deviations(&self, accuracy: f64) -> f64 {
        let count = f64::from(self.read.max(1));
        (self.sum / count).abs() / (self.variance / (count * count) + accuracy * accuracy).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose, SplitMix64};
    use dymlm_geometry::{BoxCluster, BoxView, SegmentationConfig};
    use dymlm_test_support::normal;

    use super::*;
    use crate::{DynamicsConfig, PastViews, Preprocessor};

    /// Depths of a thing on a table and of the person who sits behind it and is seen above it, metres.
    const THING: f32 = 1.4;
    const PERSON: f32 = 2.1;

    /// The detector's box around both: the thing fills the lower half of it from side to side.
    fn detected() -> BoundingBox {
        BoundingBox::new(240.0, 60.0, 380.0, 420.0).unwrap()
    }

    /// How far somebody leans at a time, seconds, who sways to and fro by `sway` metres in three seconds.
    fn lean(time: f64, sway: f32) -> f32 {
        sway * (std::f64::consts::TAU * time / 3.0).sin() as f32
    }

    /// What a Kinect reads at a time, seconds, of somebody who sways by `sway` metres.
    fn frame(time: f64, sway: f32) -> Frame {
        read(time, |u, v| match (u, v) {
            (240..380, 250..420) => THING,
            (255..365, 60..250) => PERSON - lean(time, sway),
            _ => 3.0,
        })
    }

    /// What a Kinect reads of exact depths.
    fn read(time: f64, exact: impl Fn(usize, usize) -> f32) -> Frame {
        let sensor = SensorModel::kinect();
        let mut random = SplitMix64::new(time.to_bits());
        let depth = (0..640 * 480).map(|i| {
            let exact = exact(i % 640, i / 640);
            exact + sensor.sigma(exact) * normal(&mut random) as f32
        });
        let depth = DepthImage::new(640, 480, depth.collect()).unwrap();
        let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
        Frame::new(time, camera, depth, None).unwrap()
    }

    /// Whether the thing and the person are still, when a view a second has been seen for so many seconds.
    fn are_still(frame: impl Fn(f64) -> Frame, seconds: u32) -> [bool; 2] {
        let (sensor, pose) = (SensorModel::kinect(), Pose::identity());
        let mut past = PastViews::default();
        for second in 0..seconds {
            past.remember(&frame(second.into()), &pose, &sensor);
        }
        let now = frame(seconds.into());
        let mut config = SegmentationConfig::default();
        config.spacing = 4.0;
        let mut segmenter = BoxSegmenter::new(config).unwrap();
        let mut grid = SampleGrid::default();
        segmenter.sample(&BoxView::new(&now, &sensor, detected()), &mut grid);
        segmenter.cluster(&grid, |_| true);
        let compared = ComparedFrame { frame: &now, world_from_camera: &pose, past: &past, sensor: &sensor };
        let mut motion = ClusterMotion::default();
        motion.compare(&compared, &grid, &segmenter);
        [THING, PERSON].map(|depth| {
            let is_there = |cluster: &BoxCluster| (cluster.depth - depth).abs() < 0.1;
            motion.is_still(segmenter.clusters().iter().position(is_there).unwrap())
        })
    }

    /// The depth of the mover, when the detector finds the person only after so many seconds.
    fn depth_of_mover(sway: f32, seconds: u32) -> f32 {
        let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
        let found = [Detection::new("person", 0.9, detected()).unwrap()];
        for second in 0..=seconds {
            let found = if second == seconds { &found[..] } else { &[] };
            preprocessor.process(&frame(second.into(), sway), Some(found), &Pose::identity()).unwrap();
        }
        preprocessor.movers()[0].depth.unwrap()
    }

    #[test]
    fn a_thing_is_still_and_who_sways_by_a_centimetre_behind_it_is_not() {
        for (sway, seconds) in [(0.01, 4), (0.01, 5), (0.02, 8)] {
            let still = are_still(|time| frame(time, sway), seconds);
            assert_eq!(still, [true, false], "{sway} m for {seconds} s");
        }
    }

    #[test]
    fn who_turns_is_not_still_though_the_mean_is() {
        // One shoulder comes as far as the other one goes; something beside them moves.
        let turned = |time: f64| {
            read(time, |u, v| match (u, v) {
                (240..380, 250..420) => THING,
                (255..365, 120..250) => PERSON - lean(time, 0.012) * (u as f32 - 310.0) / 55.0,
                (300..330, 60..110) => PERSON + 0.3 - lean(time, 0.02),
                _ => 3.0,
            })
        };
        for seconds in [5, 8] {
            assert_eq!(are_still(turned, seconds), [true, false], "for {seconds} s");
        }
    }

    #[test]
    fn nothing_is_still_before_something_has_surely_moved_and_four_seconds_were_seen() {
        for (sway, seconds) in [(0.0, 6), (0.004, 5), (0.02, 3)] {
            let still = are_still(|time| frame(time, sway), seconds);
            assert_eq!(still, [false, false], "{sway} m for {seconds} s");
        }
    }

    #[test]
    fn who_sways_behind_a_thing_that_stays_is_the_mover_and_not_the_thing() {
        // The thing is nearer and reaches more sides of the box: as long as nothing is known to have been
        // still, it is taken.
        for (sway, seconds, mover) in
            [(0.0, 5, THING), (0.02, 3, THING), (0.01, 5, PERSON), (0.02, 5, PERSON)]
        {
            let depth = depth_of_mover(sway, seconds);
            assert!((depth - mover).abs() < 0.1, "{depth} m with a sway of {sway} m for {seconds} s");
        }
    }

    /// The share of a leg that is masked, when somebody's body sways and the leg, more than an arm's length
    /// behind the body, sways by `sway`; the poses err by as much as `error` along the view.
    fn masked_of_leg(sway: f32, error: f64) -> f64 {
        let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
        let found = [Detection::new("person", 0.9, detected()).unwrap()];
        let (columns, rows) = (285..335, 300..400);
        for second in 0..8_u8 {
            let time = f64::from(second);
            let frame = read(time, |u, v| {
                if columns.contains(&u) && rows.contains(&v) {
                    2.4 - lean(time, sway)
                } else if (245..375).contains(&u) && (60..260).contains(&v) {
                    THING - lean(time, 0.02)
                } else {
                    3.0
                }
            });
            let translation = [0.0, 0.0, f64::from(lean(time, 1.0)) * error];
            let pose = Pose::new(translation, [0.0, 0.0, 0.0, 1.0]).unwrap();
            preprocessor.process(&frame, Some(&found), &pose).unwrap();
        }
        let of_leg = || rows.clone().flat_map(|v| columns.clone().map(move |u| (u, v)));
        let masked = of_leg().filter(|&(u, v)| !preprocessor.static_mask().at(u, v)).count();
        masked as f64 / of_leg().count() as f64
    }

    #[test]
    fn what_moves_in_a_box_is_masked_however_far_behind_the_body_it_is() {
        assert!(masked_of_leg(0.02, 0.0) > 0.95);
        assert!(masked_of_leg(0.0, 0.0) < 0.05);
        // What seems to move because the poses err, as all else does, has not moved.
        assert!(masked_of_leg(0.0, 0.03) < 0.05);
    }
}

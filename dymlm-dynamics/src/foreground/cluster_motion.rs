use dymlm_core::SensorModel;
use dymlm_geometry::{BoxSegmenter, SampleGrid};

use crate::ComparedFrame;
use crate::block_depths::mean_depth;
use crate::past_views::{EVENNESS, WATCHED};

/// Least samples of a cluster that is compared. A lower value takes the noise at edges for motion, a higher
/// one leaves the bottles on a table as likely as the person behind it.
const MIN_SAMPLES: usize = 12;
/// Most samples of a cluster that are compared: their mean has a fourteenth of the noise of one.
const MAX_SAMPLES: usize = 200;
/// Mean displacement, in standard deviations, beyond which a cluster has surely moved.
const SURELY: f64 = 3.0;

/// Which clusters of a box have stayed where they are, and which have moved, as past views show them.
///
/// What the detector has put its box around moves, if only by a sway; the things before it, on the table at
/// which it sits, do not. A sway of a centimetre is less than the noise and the steps of single readings two
/// metres away, but many times the error of a whole cluster's mean: so means are compared. Costs O(views) for
/// each sample that is compared.
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
    view: Displacement,
    /// Whether a view has shown that it has surely moved; whether one has shown that it may have.
    has_moved: bool,
    may_have_moved: bool,
    /// Time over which views have seen the cluster, seconds.
    watched: f64,
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

/// A sample of a cluster that is compared, in the camera's frame.
#[derive(Debug, Clone, Copy)]
struct Place {
    cluster: usize,
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
        self.clusters.resize(segmenter.clusters().len(), Watched::default());
        let now = compared.frame.timestamp();
        let candidates = segmenter.clusters().iter().filter(|cluster| cluster.inside >= MIN_SAMPLES).count();
        if candidates < 2 || compared.past.iter().all(|view| view.age(now) < WATCHED) {
            return;
        }
        self.choose_places(compared, grid, segmenter);
        for view in compared.past.iter() {
            let view_from_camera = view.view_from(compared.world_from_camera);
            for &Place { cluster, point } in &self.places {
                let point = view_from_camera.transform_point(point);
                let displacement = view.displacement(point, compared.sensor);
                self.clusters[cluster].view.add(displacement, point[2], compared.sensor);
            }
            self.clusters.iter_mut().for_each(|cluster| cluster.end_view(view.age(now)));
        }
    }

    /// Whether a cluster has been still while another one has moved.
    pub(super) fn is_still(&self, cluster: usize) -> bool {
        let is_still = |cluster: &Watched| !cluster.may_have_moved && cluster.watched >= WATCHED;
        self.clusters.get(cluster).is_some_and(is_still)
            && self.clusters.iter().any(|cluster| cluster.has_moved)
    }

    /// Chooses the samples that are compared, evenly spread over each cluster.
    fn choose_places(&mut self, compared: &ComparedFrame<'_>, grid: &SampleGrid, segmenter: &BoxSegmenter) {
        let (camera, depth) = (compared.frame.camera(), compared.frame.depth());
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
            let z = mean_depth(corner, grid.stride, depth, compared.sensor);
            if z > 0.0 {
                watched.compared += 1;
                let middle = corner.map(|c| c as f64 + 0.5 * (grid.stride as f64 - 1.0));
                self.places.push(Place { cluster, point: camera.back_project(middle, z.into()) });
            }
        }
    }
}

impl Watched {
    /// Takes in what a view of some age has shown, if it has seen at least half of the cluster.
    fn end_view(&mut self, age: f64) {
        let view = std::mem::take(&mut self.view);
        let seen = view.read + view.absent;
        if seen == 0 || 2 * seen < self.compared {
            return;
        }
        let deviations = if view.absent > view.read { f64::INFINITY } else { view.deviations() };
        self.may_have_moved |= deviations > 1.0;
        self.has_moved |= deviations > SURELY;
        self.watched = self.watched.max(age);
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

    /// The mean displacement in standard deviations.
    fn deviations(&self) -> f64 {
        let count = f64::from(self.read.max(1));
        (self.sum / count).abs() / (self.variance / (count * count) + EVENNESS * EVENNESS).sqrt()
    }
}

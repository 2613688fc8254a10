use dymlm_core::vector3::{difference, norm};
use dymlm_core::{Birth, FrameId, Plane, Pose, SensorModel, record};

use super::fixed_moments::FixedMoments;
use super::gap::GapLook;
use super::gap_record::{GapLooks, PlanePair};
use super::insertion::Union;
use super::label_code::{MOST_LABELS, decode, encode};
use super::placed_share::{PlacedShare, reach_of_planes};
use super::step::steps;
use crate::association::Criterion;
use crate::detector::{DetectedPlane, MOST_SITES, RayLattice};
use crate::error::Error;
use crate::moments::Moments;
use crate::patches::{Patch, VoxelLists};

/// What one key frame has added, in its camera's frame: enough to add it at any pose, and to subtract it
/// again to the bit.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct KeyFrame {
    pub(super) timestamp: f64,
    pub(super) world_from_camera: Pose,
    /// The first key frame of the look that it is part of.
    pub(super) look: FrameId,
    /// Its shares of planes, without forgotten ones.
    pub(super) shares: Vec<Share>,
    /// The label image: for each site of the lattice the label of the share that it shows, or 0; coded, with
    /// `sites` sites.
    pub(super) lattice: RayLattice,
    sites: u32,
    labels: Box<[u8]>,
    /// Motions in the world of shares, by label, since the key frame was taken.
    motions: Vec<(u16, Pose)>,
    /// Planes at which it looked without seeing them; they may have been merged into others since.
    pub(super) missed: Vec<Birth>,
    /// Merges that its insertion caused.
    pub(super) merges: Vec<Merge>,
    /// What it saw between planes, which may have been merged into others since.
    pub(super) gap_looks: GapLooks,
}

#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Merge {
    pub(super) merge: Union,
    /// The key frames that saw the gap occluded; `None` when the two planes adjoin.
    pub(super) witnesses: Option<Vec<FrameId>>,
}

/// What a key frame has seen of a plane.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Share {
    /// The plane at the time of insertion; it may have been merged into another since.
    pub(super) plane: Birth,
    /// Its moments (weight, centroid, covariance) in single precision, whose error is below a hundredth of
    /// the noise.
    weight: f32,
    centroid: [f32; 3],
    covariance: [f32; 6],
    /// The part of its weight that counts in the plane: see `Looks::next_weight`.
    pub(super) counted: f32,
    /// Its label in the key frame's image.
    label: u16,
    /// Whether the plane was seen from behind.
    pub(super) is_flipped: bool,
}

record!(KeyFrame {
    timestamp,
    world_from_camera,
    look,
    shares,
    lattice,
    sites,
    labels,
    motions,
    missed,
    merges,
    gap_looks
});
record!(Merge { merge, witnesses });
record!(Share { plane, weight, centroid, covariance, counted, label, is_flipped });

impl Share {
    /// Weight, centroid and covariance of its inliers, in the camera's frame.
    pub(super) fn own_moments(&self) -> (f64, [f64; 3], [f64; 6]) {
        (self.weight.into(), self.centroid.map(f64::from), self.covariance.map(f64::from))
    }

    /// What it adds to the sums of its plane, at a pose at which its own plane, with the normal towards the
    /// camera, is `plane`. `None` when that is out of reach.
    pub(super) fn moments_at(&self, pose: &Pose, plane: &Plane) -> Option<FixedMoments> {
        let normal = if self.is_flipped { plane.normal().map(|n| -n) } else { plane.normal() };
        FixedMoments::new(&self.moments().transformed(pose).scaled(self.counted.into()), normal)
    }

    fn moments(&self) -> Moments {
        let covariance = self.covariance.map(f64::from);
        Moments::from_covariance(self.weight.into(), self.centroid.map(f64::from), &covariance)
    }
}

impl KeyFrame {
    /// The key frame of what was detected, and its label image, as it is before it is coded. Planes beyond
    /// [`MOST_LABELS`] and samples beyond [`MOST_SITES`] are dropped; no frame has that many.
    pub(super) fn new(
        detected: &[DetectedPlane],
        timestamp: f64,
        world_from_camera: &Pose,
    ) -> (Self, Vec<u16>) {
        let lattice = detected.first().map_or(RayLattice::default(), |plane| plane.samples.lattice);
        let places = detected.iter().flat_map(|plane| &plane.samples.places);
        let last = places.filter(|&&place| (place as usize) < MOST_SITES).max();
        let sites = last.map_or(0, |last| last + 1);
        let mut labels = vec![0_u16; sites as usize];
        let mut shares = Vec::with_capacity(detected.len().min(MOST_LABELS));
        for (plane, label) in detected.iter().zip(1..=MOST_LABELS as u16) {
            for &place in &plane.samples.places {
                if let Some(site) = labels.get_mut(place as usize) {
                    *site = label;
                }
            }
            shares.push(Share {
                plane: Birth::new(0),
                weight: plane.moments.weight as f32,
                centroid: plane.moments.centroid().map(|c| c as f32),
                covariance: plane.moments.covariance().map(|c| c as f32),
                counted: 1.0,
                label,
                is_flipped: false,
            });
        }
        let key_frame = Self {
            timestamp,
            world_from_camera: *world_from_camera,
            look: FrameId::new(0),
            shares,
            lattice,
            sites,
            labels: encode(&labels, lattice.columns as usize),
            motions: Vec::new(),
            missed: Vec::new(),
            merges: Vec::new(),
            gap_looks: GapLooks::new(),
        };
        (key_frame, labels)
    }

    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        self.timestamp.is_finite()
            && self.sites as usize <= MOST_SITES
            && self.lattice.is_possible()
            && self.shares.iter().all(|share| {
                usize::from(share.label) <= MOST_LABELS && share.counted > 0.0 && share.counted <= 1.0
            })
    }

    /// Pairs of shares, by index, that its label image shows as two surfaces with a step between them, and
    /// the step's height, micrometres.
    pub(super) fn steps(
        &self,
        labels: &[u16],
        criterion: &Criterion,
        sensor: &SensorModel,
    ) -> Vec<([usize; 2], u32)> {
        let plane = |share: &Share| Some((share.label, share.moments().fit()?.plane()?));
        let planes = self.shares.iter().filter_map(plane).collect();
        let share_of = |label: u16| self.shares.iter().position(|share| share.label == label);
        let steps = steps(labels, self.lattice, &planes, criterion, sensor);
        steps
            .into_iter()
            .filter_map(|([a, b], height)| Some(([share_of(a)?, share_of(b)?], height)))
            .collect()
    }

    fn decoded(&self) -> Vec<u16> {
        decode(&self.labels, self.sites as usize, self.lattice.columns as usize)
    }

    /// The lattice sites of each share, as [`Self::placed`] needs them.
    pub(super) fn places(&self) -> Places {
        Places::of_labels(&self.decoded())
    }

    /// The shares whose planes have not been moved since they were seen.
    pub(super) fn standing_shares(&self) -> impl Iterator<Item = &Share> {
        let has_moved = |share: &&Share| self.motions.iter().any(|(label, _)| *label == share.label);
        self.shares.iter().filter(move |share| !has_moved(share))
    }

    /// The pose that takes a share from the camera's frame to its present place in the world.
    fn pose(&self, share: &Share) -> Pose {
        let motion = self.motions.iter().find(|(label, _)| *label == share.label);
        motion.map_or(self.world_from_camera, |(_, motion)| *motion * self.world_from_camera)
    }

    /// A share in the world; each call gives the same bits. O(its samples).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`].
    pub(super) fn placed(
        &self,
        share: &Share,
        places: &Places,
        voxel_size: f64,
        lists: &mut VoxelLists,
    ) -> Result<PlacedShare, Error> {
        let (pose, moments) = (self.pose(share), share.moments());
        let centroid = pose.transform_point(moments.centroid());
        let reach = reach_of_planes(voxel_size);
        let within = centroid.iter().all(|c| c.abs() < reach);
        // A detected plane always has a fit.
        let own = moments.fit().filter(|_| within).and_then(|fit| fit.plane());
        let placed = own.and_then(|own| {
            let plane = own.transformed(&pose);
            let moments = share.moments_at(&pose, &plane)?;
            let (rotation, translation) = (pose.rotation_matrix(), pose.translation());
            let to_world = |[x, y, z]: [f64; 3]| {
                std::array::from_fn(|axis| {
                    let [a, b, c] = rotation[axis];
                    a * x + b * y + c * z + translation[axis]
                })
            };
            let points = self.lattice.points(places.of(share), &own, voxel_size);
            Some(PlacedShare {
                plane,
                centroid,
                moments,
                patch: Patch::of_points(points.map(to_world), voxel_size, lists),
            })
        });
        placed.ok_or(Error::OutOfReach { centroid, reach })
    }

    /// Moves a share in the world.
    pub(super) fn move_share(&mut self, share: usize, new_from_old: &Pose) {
        let Some(label) = self.shares.get(share).map(|share| share.label) else { return };
        match self.motions.iter_mut().find(|(moved, _)| *moved == label) {
            Some((_, motion)) => *motion = *new_from_old * *motion,
            None => self.motions.push((label, *new_from_old)),
        }
    }

    /// Keeps only those samples for which `is_wanted` holds. It is called with the share and the voxel
    /// (world) at which the sample's pixel centre looks.
    pub(super) fn retain_samples(&mut self, voxel_size: f64, is_wanted: impl Fn(&Share, [i32; 3]) -> bool) {
        let mut labels = self.decoded();
        let places = Places::of_labels(&labels);
        for share in &self.shares {
            let (pose, fit) = (self.pose(share), share.moments().fit());
            let Some(own) = fit.and_then(|fit| fit.plane()) else { continue };
            let points = self.lattice.centers(places.of(share), &own);
            for (point, place) in points.zip(places.of(share)) {
                let voxel = pose.transform_point(point).map(|c| (c / voxel_size).floor() as i32);
                if !is_wanted(share, voxel) {
                    labels[place as usize] = 0;
                }
            }
        }
        self.labels = encode(&labels, self.lattice.columns as usize);
    }

    /// Removes and returns the shares of which all samples are farther than `radius` metres from a place in
    /// the world.
    pub(super) fn take_outside(&mut self, center: [f64; 3], radius: f64, voxel_size: f64) -> Vec<Share> {
        let places = self.places();
        let is_outside = |share: &Share| {
            let (pose, fit) = (self.pose(share), share.moments().fit());
            let own = fit.and_then(|fit| fit.plane());
            own.is_none_or(|own| {
                let mut points = self.lattice.centers(places.of(share), &own);
                points
                    .all(|point| norm(difference(pose.transform_point(point), center)) > radius + voxel_size)
            })
        };
        let (outside, inside) = self.shares.iter().partition(|share| is_outside(share));
        self.shares = inside;
        outside
    }

    /// Whether it saw a plane, and whether it saw it or looked at it; `resolve` gives the plane that a plane
    /// has become.
    pub(super) fn looks_at(&self, plane: Birth, resolve: impl Fn(Birth) -> Birth) -> [bool; 2] {
        let saw = self.shares.iter().any(|share| resolve(share.plane) == plane);
        [saw, saw || self.missed.iter().any(|&missed| resolve(missed) == plane)]
    }

    /// Approximate bytes that it owns.
    pub(super) fn memory_bytes(&self) -> usize {
        let witnesses = self.merges.iter().flat_map(|merge| &merge.witnesses).map(Vec::capacity);
        self.shares.capacity() * size_of::<Share>()
            + self.labels.len()
            + self.motions.capacity() * size_of::<(u16, Pose)>()
            + self.missed.capacity() * size_of::<Birth>()
            + self.merges.capacity() * size_of::<Merge>()
            + witnesses.sum::<usize>() * size_of::<FrameId>()
            + self.gap_looks.capacity() * size_of::<(PlanePair, GapLook)>()
    }
}

/// The lattice sites of a key frame's shares, by label.
#[derive(Debug)]
pub(super) struct Places(Vec<Vec<u32>>);

impl Places {
    pub(super) fn of_labels(labels: &[u16]) -> Self {
        let most = labels.iter().copied().max().unwrap_or(0);
        let mut places = vec![Vec::new(); usize::from(most) + 1];
        for (&label, site) in labels.iter().zip(0..).filter(|(label, _)| **label > 0) {
            places[usize::from(label)].push(site);
        }
        Self(places)
    }

    fn of(&self, share: &Share) -> impl Iterator<Item = u32> + '_ {
        self.0.get(usize::from(share.label)).into_iter().flatten().copied()
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, Frame, PinholeCamera};

    use super::*;
    use crate::{PlaneConfig, PlaneDetector, PlaneMap};

    /// Samples out of order, twice and far out of the image neither panic nor take memory for what lies
    /// between.
    #[test]
    fn samples_in_any_order_make_a_key_frame() {
        let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
        let depth = DepthImage::new(160, 120, vec![2.0; 160 * 120]).unwrap();
        let frame = Frame::new(0.0, camera, depth, None).unwrap();
        let config = PlaneConfig::default();
        let mut detector = PlaneDetector::new(&config.detector, &SensorModel::kinect()).unwrap();
        let mut planes = detector.detect(&frame, None, &[]).unwrap().to_vec();
        let last = planes[0].samples.places.iter().copied().max().unwrap();
        planes[0].samples.places.reverse();
        planes[0].samples.places.extend([3, 3, u32::MAX, MOST_SITES as u32, u32::MAX, 3]);

        let (key_frame, labels) = KeyFrame::new(&planes, 0.0, &Pose::identity());
        assert_eq!((key_frame.sites, labels.len()), (last + 1, last as usize + 1));
        assert_eq!(labels[3], 1);
        let mut map = PlaneMap::new(config.map, SensorModel::kinect()).unwrap();
        assert_eq!(map.insert(&planes, &frame, &Pose::identity()).unwrap().created.len(), 1);
    }
}

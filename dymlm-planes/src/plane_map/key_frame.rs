use dymlm_core::vector3::{difference, norm};
use dymlm_core::{Birth, FrameId, Pose};

use super::fixed_moments::FixedMoments;
use super::gap::GapLook;
use super::gap_record::{GapLooks, PlanePair};
use super::insertion::Union;
use super::label_code::{MOST_LABELS, decode, encode};
use super::observation::{PlacedShare, reach_of_planes};
use crate::detector::{DetectedPlane, RayLattice};
use crate::error::Error;
use crate::moments::Moments;
use crate::patches::Patch;

/// What one key frame has added, in its camera's frame: enough to add it at any pose, and to take it out
/// again to the bit.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct KeyFrame {
    pub(super) timestamp: f64,
    pub(super) world_from_camera: Pose,
    /// Without those that were forgotten.
    pub(super) shares: Vec<Share>,
    /// Which pixels show which share: its label, or 0.
    lattice: RayLattice,
    sites: u32,
    labels: Box<[u8]>,
    /// How shares, by their labels, have moved in the world since.
    motions: Vec<(u16, Pose)>,
    /// Planes that it looked at and did not see; they may have merged into others since.
    pub(super) missed: Vec<Birth>,
    /// Merges that it brought about.
    pub(super) merges: Vec<Merge>,
    /// What it saw between planes; the same.
    pub(super) gap_looks: GapLooks,
}

#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Merge {
    pub(super) merge: Union,
    /// The key frames that saw the gap occluded, when the two planes do not adjoin.
    pub(super) witnesses: Option<Vec<FrameId>>,
}

/// What a key frame has seen of a plane.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Share {
    /// The plane at that time; it may have merged into another since.
    pub(super) plane: Birth,
    /// Moments: in single precision, which errs by less than a hundredth of the noise.
    weight: f32,
    centroid: [f32; 3],
    covariance: [f32; 6],
    /// Its label in the key frame's image.
    label: u16,
    /// Whether the plane was seen from behind.
    pub(super) is_flipped: bool,
}

impl Share {
    /// Weight, centroid and covariance of its inliers, in the camera's frame.
    pub(super) fn own_moments(&self) -> (f64, [f64; 3], [f64; 6]) {
        (self.weight.into(), self.centroid.map(f64::from), self.covariance.map(f64::from))
    }

    fn moments(&self) -> Moments {
        let covariance = self.covariance.map(f64::from);
        Moments::from_covariance(self.weight.into(), self.centroid.map(f64::from), &covariance)
    }
}

impl KeyFrame {
    /// What was detected in one frame. More planes than can be labelled are no frame's.
    /// Gives its [`Self::places`] too.
    pub(super) fn new(
        detected: &[DetectedPlane],
        timestamp: f64,
        world_from_camera: &Pose,
    ) -> (Self, Places) {
        let lattice = detected.first().map_or(RayLattice::default(), |plane| plane.samples.lattice);
        let last = detected.iter().filter_map(|plane| plane.samples.places.last()).max();
        let sites = last.map_or(0, |last| last + 1);
        let mut labels = vec![0_u16; sites as usize];
        let mut shares = Vec::with_capacity(detected.len().min(MOST_LABELS));
        for (plane, label) in detected.iter().zip(1..=MOST_LABELS as u16) {
            for &place in &plane.samples.places {
                labels[place as usize] = label;
            }
            shares.push(Share {
                plane: Birth::new(0),
                weight: plane.moments.weight as f32,
                centroid: plane.moments.centroid().map(|c| c as f32),
                covariance: plane.moments.covariance().map(|c| c as f32),
                label,
                is_flipped: false,
            });
        }
        let key_frame = Self {
            timestamp,
            world_from_camera: *world_from_camera,
            shares,
            lattice,
            sites,
            labels: encode(&labels, lattice.columns as usize),
            motions: Vec::new(),
            missed: Vec::new(),
            merges: Vec::new(),
            gap_looks: GapLooks::new(),
        };
        (key_frame, Places::of_labels(&labels))
    }

    /// Whether its numbers are some that a key frame can have.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        self.timestamp.is_finite()
            && self.sites <= 1 << 24
            && self.lattice.columns <= 1 << 16
            && self.shares.iter().all(|share| usize::from(share.label) <= MOST_LABELS)
    }

    fn decoded(&self) -> Vec<u16> {
        decode(&self.labels, self.sites as usize, self.lattice.columns as usize)
    }

    /// Which pixels show which share, to place shares with.
    pub(super) fn places(&self) -> Places {
        Places::of_labels(&self.decoded())
    }

    /// The shares that stand where they were seen.
    pub(super) fn standing_shares(&self) -> impl Iterator<Item = &Share> {
        let has_moved = |share: &&Share| self.motions.iter().any(|(label, _)| *label == share.label);
        self.shares.iter().filter(move |share| !has_moved(share))
    }

    /// The pose at which a share stands in the world now.
    fn pose(&self, share: &Share) -> Pose {
        let motion = self.motions.iter().find(|(label, _)| *label == share.label);
        motion.map_or(self.world_from_camera, |(_, motion)| *motion * self.world_from_camera)
    }

    /// A share in the world, the same bits each time. O(its samples).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`].
    pub(super) fn placed(
        &self,
        share: &Share,
        places: &Places,
        voxel_size: f64,
    ) -> Result<PlacedShare, Error> {
        let (pose, moments) = (self.pose(share), share.moments());
        let centroid = pose.transform_point(moments.centroid());
        let reach = reach_of_planes(voxel_size);
        let within = centroid.iter().all(|c| c.abs() < reach);
        // A detected plane has a fit.
        let own = moments.fit().filter(|_| within).and_then(|fit| fit.plane());
        let placed = own.and_then(|own| {
            let plane = own.transformed(&pose);
            let normal = if share.is_flipped { plane.normal().map(|n| -n) } else { plane.normal() };
            let moments = FixedMoments::new(&moments.transformed(&pose), normal)?;
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
                patch: Patch::of_points(points.map(to_world), voxel_size),
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

    /// Keeps those samples of shares that are wanted, of what `is_wanted` says for the voxels in the world
    /// that their pixels' centres look at.
    pub(super) fn retain_samples(&mut self, voxel_size: f64, is_wanted: impl Fn(&Share, [i32; 3]) -> bool) {
        let mut labels = self.decoded();
        let places = Places::of_labels(&labels);
        for share in &self.shares {
            let (pose, fit) = (self.pose(share), share.moments().fit());
            let Some(own) = fit.and_then(|fit| fit.plane()) else { continue };
            let points = self.lattice.points(places.of(share), &own, f64::INFINITY);
            for (point, place) in points.zip(places.of(share)) {
                let voxel = pose.transform_point(point).map(|c| (c / voxel_size).floor() as i32);
                if !is_wanted(share, voxel) {
                    labels[place as usize] = 0;
                }
            }
        }
        self.labels = encode(&labels, self.lattice.columns as usize);
    }

    /// Takes those shares out that lie farther than `radius` metres from a place in the world with all that
    /// they show.
    pub(super) fn take_outside(&mut self, center: [f64; 3], radius: f64, voxel_size: f64) -> Vec<Share> {
        let places = self.places();
        let is_outside = |share: &Share| {
            let (pose, fit) = (self.pose(share), share.moments().fit());
            let own = fit.and_then(|fit| fit.plane());
            own.is_none_or(|own| {
                let mut points = self.lattice.points(places.of(share), &own, f64::INFINITY);
                points
                    .all(|point| norm(difference(pose.transform_point(point), center)) > radius + voxel_size)
            })
        };
        let (outside, inside) = self.shares.iter().partition(|share| is_outside(share));
        self.shares = inside;
        outside
    }

    /// Whether it saw a plane, and whether it saw it or looked at it, each taken for what `resolve` says.
    pub(super) fn looks_at(&self, plane: Birth, resolve: impl Fn(Birth) -> Birth) -> [bool; 2] {
        let saw = self.shares.iter().any(|share| resolve(share.plane) == plane);
        [saw, saw || self.missed.iter().any(|&missed| resolve(missed) == plane)]
    }

    /// Bytes that it holds.
    pub(super) fn memory_bytes(&self) -> usize {
        let witnesses = self.merges.iter().flat_map(|merge| &merge.witnesses).map(Vec::capacity);
        size_of::<(FrameId, Self)>()
            + self.shares.capacity() * size_of::<Share>()
            + self.labels.len()
            + self.motions.capacity() * size_of::<(u16, Pose)>()
            + self.missed.capacity() * size_of::<Birth>()
            + self.merges.capacity() * size_of::<Merge>()
            + witnesses.sum::<usize>() * size_of::<FrameId>()
            + self.gap_looks.capacity() * size_of::<(PlanePair, GapLook)>()
    }
}

/// The places in the lattice of a key frame's shares, by label.
#[derive(Debug)]
pub(super) struct Places(Vec<Vec<u32>>);

impl Places {
    fn of_labels(labels: &[u16]) -> Self {
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

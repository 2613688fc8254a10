use dymlm_cloud::{Verdict, Verdicts};
use dymlm_core::ObjectId;
use dymlm_core::vector3::bounds;

use crate::MultiLevelMap;
use crate::supporting_planes::MappedPlanes;

/// How often the maps are compared with the evidence, seconds of the frames' clock: often enough for maps
/// that change within seconds, seldom enough to cost a frame next to nothing.
const INTERVAL: f64 = 1.0;
/// A plane or an object is removed when more than this share of its places that were read is free space.
const FREE_SHARE: f64 = 0.5;
/// Cells of the evidence that reach into a cell of the octree by less than this share of theirs only touch
/// it: it is rounding.
const TOUCHING: f64 = 1e-6;

/// When the maps were last compared with the evidence.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct GhostRemoval {
    /// Revision of the evidence that the maps were last compared with.
    revision: u32,
    last: f64,
}

/// What a comparison with the evidence has changed in the object map.
#[derive(Debug, Default)]
pub(crate) struct FreedObjects {
    /// Objects that are gone.
    pub(crate) removed: Vec<ObjectId>,
    /// Objects with new parameters, since they were pushed along.
    pub(crate) updated: Vec<ObjectId>,
}

impl Default for GhostRemoval {
    fn default() -> Self {
        Self { revision: 0, last: f64::NEG_INFINITY }
    }
}

impl GhostRemoval {
    /// Whether the interval has passed.
    pub(crate) fn is_due(&self, timestamp: f64) -> bool {
        timestamp - self.last >= INTERVAL
    }
}

impl MultiLevelMap {
    /// Removes from octree, planes and objects what the cloud's evidence has found to be no part of the
    /// static world, when the interval has passed.
    pub(crate) fn remove_ghosts_when_due(&mut self, timestamp: f64) -> FreedObjects {
        if !self.ghost_removal.is_due(timestamp) {
            return FreedObjects::default();
        }
        let freed = self.remove_ghosts();
        self.ghost_removal.last = timestamp;
        freed
    }

    /// Whether the evidence is as it was when the maps were last compared with it.
    pub(crate) fn is_settled(&self) -> bool {
        self.ghost_removal.revision == self.cloud.evidence_revision()
    }

    /// The same at once, where the evidence has changed since the last time.
    pub(crate) fn remove_ghosts(&mut self) -> FreedObjects {
        let Self { cloud, octree, planes, objects, ghost_removal, .. } = self;
        let verdicts = cloud.verdicts();
        let boxes: Vec<[[f64; 3]; 2]> = verdicts.ghost_boxes_since(ghost_removal.revision).collect();
        // What was gone may be back where no ghost is.
        let looked_at = verdicts.changed_bounds_since(ghost_removal.revision);
        ghost_removal.revision = cloud.evidence_revision();
        let region = bounds(boxes.iter().flatten().copied());

        let half = 0.5 * octree.resolution();
        // The planes take about as long as octree and objects together.
        let judge_planes =
            || planes.judge(boxes.iter().copied(), looked_at, FREE_SHARE, |place| verdicts.is_free(place));
        let since = ghost_removal.last;
        let is_free = |place| verdicts.is_free(place) == Some(true);
        let free_others = || {
            if boxes.is_empty() {
                return (Vec::new(), Vec::new());
            }
            octree.free_cells(boxes.iter().copied(), |center| is_ghost_cell(&verdicts, center, half));
            let removed = objects.remove_where(region, |object| is_gone(&verdicts, &mut object.points()));
            (removed, objects.partly_free(region, since, is_free))
        };
        let (removed, partly_free) = crate::parallel::join(judge_planes, free_others).1;
        FreedObjects {
            removed,
            updated: objects.follow_pushed(&partly_free, since, is_free, &MappedPlanes(planes)),
        }
    }
}

/// Whether a cube holds a ghost cell and no static one.
fn is_ghost_cell(verdicts: &Verdicts<'_>, center: [f64; 3], half: f64) -> bool {
    let side = verdicts.cell_size();
    let [x, y, z] = center.map(|c| {
        // What only touches the cube is none of it.
        let (first, end) = ((c - half) / side + TOUCHING, (c + half) / side - TOUCHING);
        let (first, last) = (first.floor() as i64, end.floor() as i64);
        (first..=last).map(move |cell| (cell as f64 + 0.5) * side)
    });
    let mut holds_ghost = false;
    for z in z {
        for y in y.clone() {
            for x in x.clone() {
                match verdicts.at([x, y, z]) {
                    Some(Verdict::Static) => return false,
                    Some(_) => holds_ghost = true,
                    None => {}
                }
            }
        }
    }
    holds_ghost
}

/// Whether most of a thing's points that were read are free space now. A thing that is only occluded by a
/// person, or masked with somebody who sits on it, is still there.
fn is_gone(verdicts: &Verdicts<'_>, points: &mut dyn Iterator<Item = [f64; 3]>) -> bool {
    let (mut read, mut free) = (0_usize, 0_usize);
    for is_free in points.filter_map(|point| verdicts.is_free(point)) {
        read += 1;
        free += usize::from(is_free);
    }
    free as f64 > FREE_SHARE * read as f64
}

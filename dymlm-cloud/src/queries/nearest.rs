use super::{StaticPoint, StaticPoints};
use crate::block_store::BlockKey;

/// The nearest point so far, and the square of its distance.
#[derive(Clone, Copy)]
struct Nearest {
    squared: f64,
    /// Its place in the cloud: of equally near points the first counts.
    place: (BlockKey, usize),
    point: StaticPoint,
}

impl StaticPoints<'_> {
    /// The static point nearest to a place, if one is within `radius` metres (infinite for no limit); of
    /// equally near points the first of the cloud. Blocks are visited by their distance: O(blocks that are
    /// nearer than the answer, at most those of the map).
    pub fn nearest(&self, place: [f64; 3], radius: f64) -> Option<StaticPoint> {
        if !place.iter().all(|c| c.is_finite()) || radius.is_nan() || radius < 0.0 {
            return None;
        }
        let (stored, center) = (self.map.voxels.keys(), self.block_at(place, 0.0));
        let mut best: Option<Nearest> = None;
        for shell in 0.. {
            let limit = best.map_or(radius, |best| best.squared.sqrt());
            // Between the blocks of the shell and the block at the centre are `shell` - 1 other blocks.
            if f64::from(shell - 1) * self.block_side() - self.slack() > limit {
                break;
            }
            let around = 2 * i64::from(shell) + 1;
            if around.saturating_pow(3) > stored.len() as i64 {
                for &key in stored.iter() {
                    self.ask_block(key, place, radius, &mut best);
                }
                break;
            }
            let is_in_reach = |block: &[i32; 3]| block.iter().all(|&c| BlockKey::has_block(c));
            for key in shell_around(center, shell).filter(is_in_reach).map(BlockKey::new) {
                self.ask_block(key, place, radius, &mut best);
            }
        }
        best.map(|best| best.point)
    }

    fn ask_block(&self, key: BlockKey, place: [f64; 3], radius: f64, best: &mut Option<Nearest>) {
        let [low, high] = self.grown(key.bounds(self.voxel_size()));
        let gap = |axis: usize| (low[axis] - place[axis]).max(place[axis] - high[axis]).max(0.0);
        let limit = best.map_or(radius * radius, |best| best.squared);
        if (0..3).map(|axis| gap(axis) * gap(axis)).sum::<f64>() > limit {
            return;
        }
        let Some(slot) = self.slot_with_points(key) else { return };
        for (rank, point) in self.points_of(slot).enumerate() {
            let squared = squared_distance(place, point.position.map(f64::from));
            let found = Nearest { squared, place: (key, rank), point };
            let is_nearer = |best: &Nearest| {
                squared < best.squared || (squared == best.squared && found.place < best.place)
            };
            if squared <= radius * radius && best.as_ref().is_none_or(is_nearer) {
                *best = Some(found);
            }
        }
    }
}

fn squared_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum()
}

/// The block coordinates that differ from those of `center` by `shell` along the axis where they differ most.
fn shell_around(center: [i32; 3], shell: i32) -> impl Iterator<Item = [i32; 3]> {
    let steps = -shell..=shell;
    steps.clone().flat_map(move |z| {
        steps.clone().flat_map(move |y| {
            let is_side = z.abs() == shell || y.abs() == shell;
            // Only the two ends, or all between them as well.
            let stride = if is_side || shell == 0 { 1 } else { 2 * shell as usize };
            let xs = (-shell..=shell).step_by(stride);
            xs.map(move |x| [0, 1, 2].map(|axis| center[axis] + [x, y, z][axis]))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shells_hold_each_block_around_once() {
        let mut all: Vec<[i32; 3]> = (0..4).flat_map(|shell| shell_around([5, -7, 0], shell)).collect();
        all.sort_unstable();
        all.dedup();
        let lengths: Vec<usize> = (0..4).map(|shell| shell_around([5, -7, 0], shell).count()).collect();
        assert_eq!((all.len(), lengths), (343, vec![1, 26, 98, 218]));
    }
}

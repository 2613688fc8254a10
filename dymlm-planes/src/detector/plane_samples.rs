use dymlm_core::Plane;
use dymlm_core::vector3::{dot, norm};

/// A sample shows no more points than this along rows, and along columns: it stands for that many pixels. With
/// 1, half of a desk's side that is seen aslant is missing.
const MOST_PARTS: f64 = 4.0;

/// Which pixels of a lattice in the image show a plane's inliers, as runs: some hundred bytes tell a patch, to
/// be drawn at any pose. Camera frame.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlaneSamples {
    lattice: RayLattice,
    count: u32,
    /// Gaps before runs and lengths of runs in turn, row by row, but for the last run. Seven bits a byte, low
    /// ones first; the highest bit says that more follow.
    runs: Vec<u8>,
    last_gap: u32,
    last_length: u32,
    /// The place after the last run.
    end: u32,
}

/// Rays of a lattice in the image, x and y at depth 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct RayLattice {
    pub(crate) first: [f32; 2],
    pub(crate) step: [f32; 2],
    pub(crate) columns: u32,
}

impl PlaneSamples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Where the samples' rays meet a plane, metres, row by row.
    pub fn points(&self, plane: &Plane) -> impl Iterator<Item = [f64; 3]> {
        self.points_within(plane, f64::INFINITY)
    }

    /// The same, but a sample shows as many points side by side, up to one a pixel, as lie no more than
    /// `spacing` metres apart: seen aslant or from afar, samples are sparser than the voxels of a patch.
    pub(crate) fn points_within(&self, plane: &Plane, spacing: f64) -> impl Iterator<Item = [f64; 3]> {
        let (normal, d, lattice) = (plane.normal(), plane.d(), self.lattice);
        let [first, step] = [lattice.first, lattice.step].map(|ray| ray.map(f64::from));
        let meet = move |ray: [f64; 3]| {
            let z = -d / dot(normal, ray);
            ray.map(|c| c * z)
        };
        self.places().flat_map(move |place| {
            let at = [place % lattice.columns.max(1), place / lattice.columns.max(1)].map(f64::from);
            let [x, y] = std::array::from_fn(|axis| first[axis] + at[axis] * step[axis]);
            let center = meet([x, y, 1.0]);
            let [columns, rows] = std::array::from_fn(|axis| {
                // How the point moves with the ray: z (e - r n_axis / n.r).
                let mut moved = center.map(|c| -c * normal[axis] / dot(normal, [x, y, 1.0]));
                moved[axis] += center[2];
                (norm(moved) * step[axis].abs() / spacing).ceil().clamp(1.0, MOST_PARTS) as u32
            });
            let part = move |k: u32, parts: u32| (f64::from(k) + 0.5) / f64::from(parts) - 0.5;
            (0..columns * rows).map(move |k| {
                let [du, dv] = [part(k % columns, columns), part(k / columns, rows)];
                meet([x + du * step[0], y + dv * step[1], 1.0])
            })
        })
    }

    /// Those whose place in [`Self::points`] is wanted.
    pub(crate) fn retained(&self, mut is_wanted: impl FnMut(usize) -> bool) -> Self {
        let mut kept = Self::default();
        kept.begin(self.lattice);
        self.places().enumerate().filter(|(k, _)| is_wanted(*k)).for_each(|(_, place)| kept.push(place));
        kept
    }

    /// Makes it that of another lattice, without samples.
    pub(crate) fn begin(&mut self, lattice: RayLattice) {
        self.runs.clear();
        *self = Self { lattice, runs: std::mem::take(&mut self.runs), ..Self::default() };
    }

    /// Adds a place of the lattice, row by row; they come in order.
    pub(crate) fn push(&mut self, place: u32) {
        if place > self.end || self.count == 0 {
            if self.count > 0 {
                write_number(&mut self.runs, self.last_gap);
                write_number(&mut self.runs, self.last_length);
            }
            (self.last_gap, self.last_length) = (place - self.end, 0);
        }
        self.last_length += 1;
        self.count += 1;
        self.end = place + 1;
    }

    fn places(&self) -> impl Iterator<Item = u32> {
        let mut bytes = self.runs.iter();
        let mut number = move || read_number(&mut bytes);
        let written = std::iter::from_fn(move || Some([number()?, number()?]));
        let last = (self.count > 0).then_some([self.last_gap, self.last_length]);
        let mut next = 0;
        written.chain(last).flat_map(move |[gap, length]| {
            let first = next + gap;
            next = first + length;
            first..next
        })
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.runs.capacity()
    }
}

fn write_number(bytes: &mut Vec<u8>, mut number: u32) {
    while number > 0x7f {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

fn read_number<'a>(bytes: &mut impl Iterator<Item = &'a u8>) -> Option<u32> {
    let (mut number, mut shift) = (0, 0);
    loop {
        let byte = *bytes.next()?;
        number |= u32::from(byte & 0x7f).wrapping_shl(shift);
        if byte & 0x80 == 0 {
            return Some(number);
        }
        shift += 7;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn holds_what_was_put_in(places in prop::collection::btree_set(0..40_000_u32, 0..200)) {
            // Runs of three, some of which join.
            let places: std::collections::BTreeSet<u32> = places.iter().flat_map(|&p| p..p + 3).collect();
            let lattice = RayLattice { first: [-0.5, -0.4], step: [0.01, 0.01], columns: 100 };
            let mut samples = PlaneSamples::default();
            samples.begin(lattice);
            for &place in &places {
                samples.push(place);
            }
            prop_assert_eq!(samples.len(), places.len());
            prop_assert!(samples.places().eq(places.iter().copied()));
            prop_assert!(samples.memory_bytes() <= 2 * (3 * places.len() + 8));
            let even = samples.retained(|k| k % 2 == 0);
            prop_assert!(even.places().eq(places.iter().copied().step_by(2)));
        }
    }

    #[test]
    fn rays_meet_the_plane() {
        let mut samples = PlaneSamples::default();
        samples.begin(RayLattice { first: [-0.5, -0.5], step: [0.5, 0.25], columns: 3 });
        samples.push(1);
        samples.push(5);
        let plane = Plane::new([0.0, 0.0, -1.0], 2.0).unwrap();
        assert_eq!(samples.points(&plane).collect::<Vec<_>>(), [[0.0, -1.0, 2.0], [1.0, -0.5, 2.0]]);
        // 1 m apart along rows, half a metre along columns.
        let dense: Vec<_> = samples.points_within(&plane, 0.5).take(3).collect();
        assert_eq!(dense, [[-0.25, -1.0, 2.0], [0.25, -1.0, 2.0], [0.75, -0.5, 2.0]]);
    }
}

/// Indices of a cell along x, y, z: `floor(coordinate / resolution) + 32768`, as OctoMap's keys.
pub(crate) type Key = [u16; 3];

/// A key as one integer.
#[inline]
pub(crate) fn pack(key: Key) -> u64 {
    u64::from(key[0]) | u64::from(key[1]) << 16 | u64::from(key[2]) << 32
}

/// Octree levels: a cell is at depth 16, the whole map at depth 0.
pub(crate) const DEPTH: u8 = 16;

/// The key of the cell whose lower corner is the world's origin.
const CENTER: i32 = 32768;

/// The first number that is no index.
pub(crate) const OUTSIDE: u32 = 65536;

/// The grid of smallest cells. Its arithmetic is OctoMap's, operation by operation, so that keys agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lattice {
    pub(crate) resolution: f64,
    /// 1 / resolution.
    factor: f64,
}

impl Lattice {
    pub(crate) fn new(resolution: f64) -> Self {
        Self { resolution, factor: 1.0 / resolution }
    }

    /// Distance from the world's origin to the border, metres.
    pub(crate) fn half_extent(&self) -> f64 {
        f64::from(CENTER) * self.resolution
    }

    /// The index of the cell that holds a coordinate; `None` outside the map and for NaN.
    #[inline]
    pub(crate) fn index(&self, coordinate: f64) -> Option<u16> {
        u16::try_from(self.wide_index(coordinate)).ok()
    }

    /// The index of the cell that holds a coordinate; 65536 or more outside the map and for NaN. Without a
    /// branch, so that the three indices of a point are computed side by side.
    #[inline]
    fn wide_index(&self, coordinate: f64) -> u64 {
        // Numbers of 2^51 or more in size, and NaN, change the upper bits of the magic number, so that the
        // result is far above 65535.
        floor_bits(self.factor * coordinate).wrapping_sub(MAGIC.to_bits()).wrapping_add(CENTER as u64)
    }

    /// The indices of the cells that hold many coordinates; [`OUTSIDE`] or more outside the map and for NaN.
    #[inline]
    pub(crate) fn indices(&self, coordinates: &[f32], indices: &mut [u32]) {
        // Some place outside the map whose index has room in 32 bits.
        let far = (1e6 * self.resolution) as f32;
        for (index, &coordinate) in indices.iter_mut().zip(coordinates) {
            // NaN fails the first comparison.
            let low = if coordinate > -far { coordinate } else { -far };
            let coordinate = if low < far { low } else { far };
            *index = (floor_bits(self.factor * f64::from(coordinate)) as u32).wrapping_add(CENTER as u32);
        }
    }

    /// The cell that holds a point; `None` outside the map and for NaN.
    #[inline]
    pub(crate) fn key(&self, point: [f64; 3]) -> Option<Key> {
        let [x, y, z] = point.map(|coordinate| self.wide_index(coordinate));
        ((x | y | z) < u64::from(OUTSIDE)).then_some([x as u16, y as u16, z as u16])
    }

    /// The cell that holds a point given in single precision.
    #[inline]
    pub(crate) fn key_f32(&self, point: [f32; 3]) -> Option<Key> {
        self.key(point.map(f64::from))
    }

    /// Centre of the cells with an index, metres.
    #[inline]
    pub(crate) fn center(&self, index: u16) -> f64 {
        (f64::from(i32::from(index) - CENTER) + 0.5) * self.resolution
    }

    /// Centre of a cell in single precision, as OctoMap has it.
    #[inline]
    pub(crate) fn center_f32(&self, key: Key) -> [f32; 3] {
        key.map(|index| self.center(index) as f32)
    }

    /// Side of a cell of the octree at a depth, metres.
    pub(crate) fn size(&self, depth: u8) -> f64 {
        self.resolution * f64::from(1_u32 << (DEPTH - depth))
    }

    /// Lower corner of the octree cell that begins at a key, metres.
    pub(crate) fn corner(&self, key: Key) -> [f64; 3] {
        key.map(|index| f64::from(i32::from(index) - CENTER) * self.resolution)
    }
}

/// Adding 1.5 * 2^52 to a number below 2^51 rounds it to the nearest integer, and leaves it in the low bits.
const MAGIC: f64 = 3.0 * (1_u64 << 51) as f64;

/// The bits of [`MAGIC`] plus the largest integer that is not above a number.
#[inline]
fn floor_bits(number: f64) -> u64 {
    let nearest = number + MAGIC;
    nearest.to_bits().wrapping_sub(u64::from(nearest - MAGIC > number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_floors() {
        let lattice = Lattice::new(0.1);
        assert_eq!(lattice.index(0.0), Some(32768));
        assert_eq!(lattice.index(-1e-18), Some(32767));
        assert_eq!(lattice.index(-0.1), Some(32767));
        assert_eq!(lattice.index(0.25), Some(32770));
        assert_eq!(lattice.index(-3276.8), Some(0));
        assert_eq!(lattice.index(3276.8), None);
        for outside in
            [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e300, 1e15, -1e15, 1e16, -1e16, 3e18, -3276.9]
        {
            assert_eq!(lattice.index(outside), None);
        }
    }

    #[test]
    fn many_indices_at_once_are_the_same() {
        let lattice = Lattice::new(0.05);
        let mut coordinates =
            vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -0.0, 1638.4, -1638.4];
        for index in 32700..32900_u16 {
            let border = lattice.corner([index; 3])[0] as f32;
            coordinates.extend([
                border,
                border.next_up(),
                border.next_down(),
                border * 49.0,
                border * 1000.0,
            ]);
        }
        let mut indices = vec![0; coordinates.len()];
        lattice.indices(&coordinates, &mut indices);
        for (&coordinate, &index) in coordinates.iter().zip(&indices) {
            let expected = lattice.index(f64::from(coordinate));
            assert_eq!(u16::try_from(index).ok(), expected, "{coordinate}");
        }
    }

    #[test]
    fn centres_lie_in_their_cells() {
        for resolution in [0.02, 0.05, 0.08, 1.7] {
            let lattice = Lattice::new(resolution);
            for index in [0, 1, 7, 32767, 32768, 40000, 65535] {
                assert_eq!(lattice.index(lattice.center(index)), Some(index));
                assert_eq!(lattice.index(f64::from(lattice.center(index) as f32)), Some(index));
            }
        }
    }
}

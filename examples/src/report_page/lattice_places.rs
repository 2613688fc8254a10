use dymlm::core::{Point, Rgb};

/// Most steps of a lattice along an axis, which 16 bits can count.
const MOST_STEPS: f64 = 65_535.0;
/// Finest step of a lattice, metres: the sensors' noise is larger.
const FINEST_STEP: f64 = 1e-3;

/// Places in space as whole numbers of steps from an origin, and bytes that belong to them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LatticePlaces {
    /// The place with key 0 0 0, metres, world.
    pub(super) origin: [f64; 3],
    /// Metres from one key to the next.
    pub(super) step: f64,
    /// Steps from the origin along x, y, z.
    pub(super) keys: Vec<[u16; 3]>,
    /// Channels of one byte for each place.
    pub(super) channels: Vec<Vec<u8>>,
}

impl LatticePlaces {
    /// Rounds points (metres, world) to a lattice of millimetres, or to a coarser one where 16 bits do not
    /// span the points. Points that are not finite are left out. Colours become three channels.
    pub(super) fn of_points(points: &[Point], colors: Option<&[Rgb]>) -> Self {
        let finite = |point: &Point| point.iter().all(|c| c.is_finite());
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in points.iter().filter(|point| finite(point)) {
            for axis in 0..3 {
                low[axis] = low[axis].min(f64::from(point[axis]));
                high[axis] = high[axis].max(f64::from(point[axis]));
            }
        }
        if low[0] > high[0] {
            low = [0.0; 3];
            high = low;
        }
        let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let step = (extent / MOST_STEPS).max(FINEST_STEP);
        let key = |point: &Point| {
            [0, 1, 2].map(|axis| ((f64::from(point[axis]) - low[axis]) / step).round() as u16)
        };
        let keys = points.iter().filter(|point| finite(point)).map(key).collect();
        let channels = colors.map_or_else(Vec::new, |colors| {
            let kept = || points.iter().zip(colors).filter(|(point, _)| finite(point));
            (0..3).map(|channel| kept().map(|(_, color)| color[channel]).collect()).collect()
        });
        Self { origin: low, step, keys, channels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dymlm::core::SplitMix64;

    /// The place of a key.
    fn place(places: &LatticePlaces, key: [u16; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| places.origin[axis] + f64::from(key[axis]) * places.step)
    }

    fn check(points: &[Point]) {
        let places = LatticePlaces::of_points(points, None);
        assert_eq!(places.keys.len(), points.len());
        for (point, &key) in points.iter().zip(&places.keys) {
            for (read, written) in point.iter().zip(place(&places, key)) {
                let error = (f64::from(*read) - written).abs();
                assert!(
                    error <= 0.5 * places.step * (1.0 + 1e-9),
                    "{read} became {written}, step {}",
                    places.step
                );
            }
        }
    }

    #[test]
    fn points_move_by_half_a_step_at_most() {
        let mut random = SplitMix64::new(5);
        for extent in [0.01, 3.0, 65.0, 66.0, 5_000.0, 1e20] {
            let points: Vec<Point> =
                (0..2_000).map(|_| [0; 3].map(|_| ((random.fraction() - 0.3) * extent) as f32)).collect();
            check(&points);
            let step = LatticePlaces::of_points(&points, None).step;
            assert!(step >= FINEST_STEP && step <= (extent / MOST_STEPS).max(FINEST_STEP));
        }
    }

    #[test]
    fn degenerate_clouds() {
        let empty = LatticePlaces::of_points(&[], Some(&[]));
        assert_eq!(empty.keys, Vec::<[u16; 3]>::new());
        assert!(empty.step > 0.0 && empty.origin == [0.0; 3] && empty.channels == vec![Vec::<u8>::new(); 3]);
        check(&[[1.5, -2.0, 1e6]]);
        check(&[[7.0, 7.0, 7.0]; 5]);
        check(&[[f32::MIN, 0.0, 0.0], [f32::MAX, 0.0, 0.0]]);
        // The extreme keys of the lattice are used and not exceeded.
        let ends = LatticePlaces::of_points(&[[0.0; 3], [131.07, 1.0, 0.0]], None);
        assert_eq!(ends.keys[1][0], u16::MAX);
    }

    #[test]
    fn points_that_are_not_finite_go_with_their_colours() {
        let points = [[f32::NAN, 0.0, 0.0], [1.0, 2.0, 3.0], [0.0, f32::INFINITY, 0.0], [1.0, 2.0, 3.5]];
        let colors = [[1, 1, 1], [2, 3, 4], [5, 5, 5], [6, 7, 8]];
        let places = LatticePlaces::of_points(&points, Some(&colors));
        assert_eq!(places.keys, [[0, 0, 0], [0, 0, 500]]);
        assert_eq!(places.channels, [[2, 6], [3, 7], [4, 8]]);
        assert_eq!(LatticePlaces::of_points(&points[..1], None).keys.len(), 0);
    }
}

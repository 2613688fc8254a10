/// Drops corners of a closed ring that lie within `tolerance` of the line between the kept corners around
/// them.
///
/// Douglas, Peucker (1973), applied to the two halves of the ring between its first corner in coordinate
/// order and the corner farthest from that one. Usually O(n log n).
pub(super) fn simplify_ring(ring: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    if ring.len() <= 4 {
        return ring.to_vec();
    }
    let first = (0..ring.len()).min_by(|&a, &b| order(ring[a], ring[b])).unwrap_or(0);
    let mut turned: Vec<[f64; 2]> = ring[first..].iter().chain(&ring[..=first]).copied().collect();
    let last = turned.len() - 1;
    let farthest = (0..last)
        .max_by(|&a, &b| distance(turned[a], turned[0]).total_cmp(&distance(turned[b], turned[0])))
        .unwrap_or(0);
    let mut kept = vec![false; turned.len()];
    kept[0] = true;
    kept[farthest] = true;
    let mut open = vec![(0, farthest), (farthest, last)];
    while let Some((from, to)) = open.pop() {
        let off = |i: usize| distance_to_segment(turned[i], turned[from], turned[to]);
        let Some(worst) = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b))) else { continue };
        if off(worst) > tolerance {
            kept[worst] = true;
            open.push((from, worst));
            open.push((worst, to));
        }
    }
    kept[last] = false;
    let mut index = 0;
    turned.retain(|_| {
        index += 1;
        kept[index - 1]
    });
    // A ring of two corners has no area; a ring that is too small for the tolerance stays as it is.
    if turned.len() < 3 { ring.to_vec() } else { turned }
}

fn order(a: [f64; 2], b: [f64; 2]) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn distance_to_segment(point: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    if length == 0.0 {
        return distance(point, a);
    }
    let part = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / length;
    let part = part.clamp(0.0, 1.0);
    distance(point, [a[0] + part * along[0], a[1] + part * along[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_become_a_slope_and_corners_stay() {
        // A right triangle of 40 cells whose slope is a staircase.
        let mut ring = vec![[0.0, 0.0], [40.0, 0.0]];
        for step in (0..40).rev() {
            ring.push([f64::from(step + 1), f64::from(40 - step)]);
            ring.push([f64::from(step), f64::from(40 - step)]);
        }
        let simple = simplify_ring(&ring, 1.0);
        assert!(simple.len() <= 4, "{simple:?}");
        for corner in [[0.0, 0.0], [40.0, 0.0], [0.0, 40.0]] {
            assert!(simple.iter().any(|kept| distance(*kept, corner) <= 1.5));
        }
        assert_eq!(simplify_ring(&ring, 0.0).len(), ring.len());
    }

    #[test]
    fn does_not_depend_on_where_the_ring_starts() {
        let ring = [[0.0, 0.0], [2.0, 0.1], [4.0, 0.0], [4.0, 3.0], [2.0, 2.9], [0.0, 3.0]];
        let expected = simplify_ring(&ring, 0.5);
        for start in 1..ring.len() {
            let turned: Vec<_> = ring[start..].iter().chain(&ring[..start]).copied().collect();
            assert_eq!(simplify_ring(&turned, 0.5), expected);
        }
    }
}

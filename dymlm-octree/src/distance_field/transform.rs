use std::array::from_fn;

use super::cell_box::CellBox;

/// Exact squared Euclidean distances, in cells, by one pass along each axis: in the first the cells are
/// counted, in the others the lower envelope of parabolas is found (Felzenszwalb and Huttenlocher: "Distance
/// transforms of sampled functions", Theory of Computing 8, 2012). Squares of whole numbers this small are
/// exact in `f32`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Transform {
    /// Which cells are obstacles, x fastest.
    pub(super) obstacles: Vec<bool>,
    /// Squared distances along x in a layer across z.
    layer: Vec<f32>,
    /// The same after the pass along y, for all layers.
    layers: Vec<f32>,
    column: Vec<f32>,
    envelope: Vec<Parabola>,
}

/// A parabola of the envelope: where it has its lowest point and how high that is, and from where on it is
/// the lowest.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    at: usize,
    height: f32,
    from: f64,
}

/// How many cells along an axis are within a distance; `None` for one that is not positive or beyond
/// counting.
pub(super) fn cells_within(distance: f64, resolution: f64) -> Option<usize> {
    let cells = distance / resolution;
    (distance > 0.0 && cells < 1e6).then_some(cells as usize)
}

impl Transform {
    /// Squared distances from the cells of a box without a margin of `reach` cells along each axis to its
    /// obstacles, x fastest; those beyond the reach may be infinite.
    pub(super) fn measure(&mut self, around: &CellBox, reach: [usize; 3], squared: &mut Vec<f32>) {
        let Self { obstacles, layer, layers, column, envelope } = self;
        let [width, height, depth] = around.size;
        let [inner_width, inner_height, inner_depth] = from_fn(|axis| around.size[axis] - 2 * reach[axis]);
        let inner_layer = inner_width * inner_height;
        resize(layer, inner_width * height);
        resize(layers, inner_layer * depth);
        resize(squared, inner_layer * inner_depth);
        for (cells, after_y) in
            obstacles.chunks_exact(width * height).zip(layers.chunks_exact_mut(inner_layer))
        {
            for (row, along_x) in cells.chunks_exact(width).zip(layer.chunks_exact_mut(inner_width)) {
                measure_row(row, reach[0], along_x);
            }
            for x in 0..inner_width {
                gather(layer, x, inner_width, column);
                find_envelope(column, envelope);
                write_envelope(envelope, reach[1], after_y[x..].iter_mut().step_by(inner_width));
            }
        }
        for place in 0..inner_layer {
            gather(layers, place, inner_layer, column);
            find_envelope(column, envelope);
            write_envelope(envelope, reach[2], squared[place..].iter_mut().step_by(inner_layer));
        }
    }

    /// [`Self::measure`] in a rectangle of cells, x fastest.
    pub(crate) fn measure_layer(
        &mut self,
        is_obstacle: impl Iterator<Item = bool>,
        [width, height]: [usize; 2],
        squared: &mut Vec<f32>,
    ) {
        self.obstacles.clear();
        self.obstacles.extend(is_obstacle);
        self.measure(&CellBox { first: [0; 3], size: [width, height, 1] }, [0; 3], squared);
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let floats = self.layer.capacity() + self.layers.capacity() + self.column.capacity();
        self.obstacles.capacity()
            + floats * size_of::<f32>()
            + self.envelope.capacity() * size_of::<Parabola>()
    }
}

/// Room for so many numbers; what they are does not matter.
fn resize(numbers: &mut Vec<f32>, len: usize) {
    numbers.resize(len, 0.0);
}

/// Every `stride`-th number from one on.
fn gather(numbers: &[f32], from: usize, stride: usize, column: &mut Vec<f32>) {
    column.clear();
    column.extend(numbers.get(from..).unwrap_or(&[]).iter().step_by(stride));
}

/// Squared distances along a row, of its cells without the margins.
fn measure_row(row: &[bool], reach: usize, squared: &mut [f32]) {
    squared.fill(f32::INFINITY);
    if !row.contains(&true) {
        return;
    }
    let inner = reach..row.len() - reach;
    let mut count = |indices: &mut dyn Iterator<Item = usize>| {
        let mut away: Option<usize> = None;
        for index in indices {
            away = if row[index] { Some(0) } else { away.map(|away| away + 1) };
            if let Some(away) = away.filter(|_| inner.contains(&index)) {
                let squared = &mut squared[index - reach];
                *squared = squared.min((away * away) as f32);
            }
        }
    };
    count(&mut (0..row.len()));
    count(&mut (0..row.len()).rev());
}

/// The lower envelope of parabolas on the finite heights of a column.
fn find_envelope(heights: &[f32], envelope: &mut Vec<Parabola>) {
    envelope.clear();
    for (at, &height) in heights.iter().enumerate().filter(|(_, height)| height.is_finite()) {
        let mut from = f64::NEG_INFINITY;
        while let Some(last) = envelope.last() {
            from = last.crossing(at, height);
            if from > last.from {
                break;
            }
            envelope.pop();
            from = f64::NEG_INFINITY;
        }
        envelope.push(Parabola { at, height, from });
    }
}

/// The envelope's heights from an index on.
fn write_envelope<'a>(envelope: &[Parabola], first: usize, out: impl Iterator<Item = &'a mut f32>) {
    let mut rest = envelope;
    for (index, out) in (first..).zip(out) {
        while let [_, next, ..] = rest
            && next.from <= index as f64
        {
            rest = &rest[1..];
        }
        *out = rest.first().map_or(f32::INFINITY, |parabola| {
            let away = parabola.at.abs_diff(index);
            (away * away) as f32 + parabola.height
        });
    }
}

impl Parabola {
    /// Where a parabola farther on becomes lower than this one.
    fn crossing(&self, at: usize, height: f32) -> f64 {
        let [own, other] = [self.at as f64, at as f64];
        let rise = f64::from(height) + other * other - f64::from(self.height) - own * own;
        rise / (2.0 * (other - own))
    }
}

use std::array::from_fn;

use super::cell_box::CellBox;

/// Exact squared Euclidean distances, in cells, by one pass along each axis: the first counts cells, the
/// others find the lower envelope of parabolas (Felzenszwalb and Huttenlocher: "Distance transforms of
/// sampled functions", Theory of Computing 8, 2012). Squared distances are exact in `f32` up to 2^24, which
/// is 4096 cells squared.
#[derive(Debug, Clone, Default)]
pub(crate) struct Transform {
    /// Which cells are obstacles, x fastest.
    pub(super) obstacles: Vec<bool>,
    /// Squared distances along x in one layer of equal z.
    layer: Vec<f32>,
    /// Squared distances after the pass along y, for all layers.
    layers: Vec<f32>,
    column: Vec<f32>,
    envelope: Vec<Parabola>,
}

/// A parabola of the envelope: the index of its vertex, the vertex's height, and from where on this parabola
/// is the lowest.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    at: usize,
    height: f32,
    from: f64,
}

/// How many cells along an axis are within a distance; `None` for a distance that is not positive, or is 1e6
/// cells or more.
pub(super) fn cells_within(distance: f64, resolution: f64) -> Option<usize> {
    let cells = distance / resolution;
    (distance > 0.0 && cells < 1e6).then_some(cells as usize)
}

impl Transform {
    /// Squared distances, in cells, from the cells of a box, without a margin of `reach` cells on each side,
    /// to the obstacles of the whole box, x fastest; distances beyond the reach may be infinite.
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

    /// [`Self::measure`] for a rectangle of cells, x fastest.
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

/// Makes room for `len` numbers; their values do not matter.
fn resize(numbers: &mut Vec<f32>, len: usize) {
    numbers.resize(len, 0.0);
}

/// Every `stride`-th number, from the index `from` on.
fn gather(numbers: &[f32], from: usize, stride: usize, column: &mut Vec<f32>) {
    column.clear();
    column.extend(numbers.get(from..).unwrap_or(&[]).iter().step_by(stride));
}

/// Squared distances along a row to its obstacles, for the cells between its margins.
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

/// Writes the envelope's heights from the index `first` on.
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
    /// Where a parabola with its vertex farther on becomes lower than this one.
    fn crossing(&self, at: usize, height: f32) -> f64 {
        let [own, other] = [self.at as f64, at as f64];
        let rise = f64::from(height) + other * other - f64::from(self.height) - own * own;
        rise / (2.0 * (other - own))
    }
}

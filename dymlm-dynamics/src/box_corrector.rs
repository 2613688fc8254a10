use dymlm_core::{BoundingBox, DepthImage, Frame};

use crate::Foreground;

/// Least pixels of a line that must continue the foreground for a side to move past the line, in a 640x480
/// image: more than a stray reading, fewer than a wrist at 3 m.
const MIN_PIXELS: u8 = 3;
/// Widest gap without depth that is bridged, in the same pixels: the shadow at the rim of a structured-light
/// silhouette.
const MAX_GAP: u8 = 6;

/// Corrects boxes that cut a mover short: paper section III-A.
///
/// First the box is extended to the parts of the foreground found around it. Then each side moves outward,
/// line by line, while pixels just outside it continue the foreground in depth, at most `max_extension`
/// pixels in all. Sides never move inward. The left and right sides move first, so that the upper and lower
/// sides see arms that stick out; then the left and right sides move again with what is left of their
/// allowance.
///
/// Costs O(perimeter times extension).
#[derive(Debug, Clone)]
pub(crate) struct BoxCorrector {
    /// Largest distance that a side moves, in pixels of a 640x480 image.
    max_extension: f64,
    wave: Vec<Front>,
    next: Vec<Front>,
}

/// The state of the wave, which moves outward line by line, at one pixel of a line.
#[derive(Debug, Clone, Copy, Default)]
struct Front {
    /// Depth of the foreground at this pixel, or where it was last seen on the way; 0 = no foreground.
    depth: f32,
    /// Lines without depth since then.
    gap: usize,
}

/// Pixels of a box: columns `left..right`, rows `top..bottom`.
#[derive(Debug, Clone, Copy)]
struct Window {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
    Top,
    Bottom,
}

impl BoxCorrector {
    /// Makes a corrector that moves sides by at most `max_extension` pixels of a 640x480 image.
    pub(crate) fn new(max_extension: f32) -> Self {
        Self { max_extension: max_extension.into(), wave: Vec::new(), next: Vec::new() }
    }

    /// The corrected box. Sides that do not move keep their fractions of a pixel and may stay outside the
    /// image. The box stays as it is when there is no foreground or no pixel of it is in the image.
    pub(crate) fn correct(
        &mut self,
        frame: &Frame,
        bounding_box: &BoundingBox,
        foreground: &Foreground,
    ) -> BoundingBox {
        let (depth, scale) = (frame.depth(), frame.camera().size_scale());
        let allowance = (self.max_extension * scale).round() as usize;
        let columns = bounding_box.columns(depth.width());
        let rows = bounding_box.rows(depth.height());
        if foreground.is_empty() || allowance == 0 || columns.is_empty() || rows.is_empty() {
            return *bounding_box;
        }
        let start = Window { left: columns.start, right: columns.end, top: rows.start, bottom: rows.end };
        let limit = Window {
            left: start.left.saturating_sub(allowance),
            right: (start.right + allowance).min(depth.width()),
            top: start.top.saturating_sub(allowance),
            bottom: (start.bottom + allowance).min(depth.height()),
        };
        let mut window = start.with_parts(foreground, limit);
        for side in [Side::Left, Side::Right, Side::Top, Side::Bottom, Side::Left, Side::Right] {
            self.extend(side, depth, scale, foreground, limit, &mut window);
        }
        widened(bounding_box, start, window)
    }

    /// Moves one side outward as far as the foreground continues.
    fn extend(
        &mut self,
        side: Side,
        depth: &DepthImage,
        scale: f64,
        foreground: &Foreground,
        limit: Window,
        window: &mut Window,
    ) {
        let min_pixels = (f64::from(MIN_PIXELS) * scale).round().max(1.0) as usize;
        let max_gap = (f64::from(MAX_GAP) * scale).round() as usize;
        self.start_wave(side, depth, foreground, window, max_gap);
        let mut current = *window;
        while let Some(line) = current.step_outward(side, limit) {
            let active = self.advance(side, line, depth, foreground, &current, max_gap);
            if active >= min_pixels {
                *window = current;
            }
            if self.wave.iter().all(|front| front.depth == 0.0) {
                break;
            }
        }
    }

    /// Fills the wave with the foreground pixels along the inside of a side.
    fn start_wave(
        &mut self,
        side: Side,
        depth: &DepthImage,
        foreground: &Foreground,
        window: &Window,
        max_gap: usize,
    ) {
        self.wave.clear();
        self.wave.resize(window.length_of(side), Front::default());
        for inward in (0..=max_gap).rev() {
            let Some(line) = window.line_inside(side, inward) else { continue };
            for (along, front) in self.wave.iter_mut().enumerate() {
                let (u, v) = window.pixel(side, line, along);
                let z = depth.at(u, v);
                if z > 0.0 {
                    *front = if foreground.holds(u, v, z)
                        || (front.depth > 0.0 && foreground.continues(front.depth, z))
                    {
                        Front { depth: z, gap: 0 }
                    } else {
                        Front::default()
                    };
                } else {
                    *front = front.carried(max_gap);
                }
            }
        }
    }

    /// Moves the wave one line outward; returns the number of pixels at which the foreground continues.
    fn advance(
        &mut self,
        side: Side,
        line: usize,
        depth: &DepthImage,
        foreground: &Foreground,
        window: &Window,
        max_gap: usize,
    ) -> usize {
        let wave = &self.wave;
        let continues = |front: Option<&Front>, z: f32| {
            front.is_some_and(|front| front.depth > 0.0 && foreground.continues(front.depth, z))
        };
        self.next.clear();
        self.next.extend(wave.iter().enumerate().map(|(along, front)| {
            let (u, v) = window.pixel(side, line, along);
            let z = depth.at(u, v);
            if z == 0.0 {
                return front.carried(max_gap);
            }
            let before = along.checked_sub(1).and_then(|before| wave.get(before));
            let goes_on = foreground.reaches(z)
                && !foreground.is_background(u, v, z)
                && (continues(Some(front), z) || continues(before, z) || continues(wave.get(along + 1), z));
            if goes_on { Front { depth: z, gap: 0 } } else { Front::default() }
        }));
        std::mem::swap(&mut self.wave, &mut self.next);
        self.wave.iter().filter(|front| front.depth > 0.0 && front.gap == 0).count()
    }
}

impl Front {
    fn carried(self, max_gap: usize) -> Self {
        if self.depth > 0.0 && self.gap < max_gap {
            Self { depth: self.depth, gap: self.gap + 1 }
        } else {
            Self::default()
        }
    }
}

impl Window {
    /// The window enlarged to all foreground found around it, as far as `limit` allows.
    fn with_parts(self, foreground: &Foreground, limit: Self) -> Self {
        let Some(found) = foreground.bounds() else { return self };
        Self {
            left: self.left.min(found.left).max(limit.left),
            right: self.right.max(found.right + 1).min(limit.right),
            top: self.top.min(found.top).max(limit.top),
            bottom: self.bottom.max(found.bottom + 1).min(limit.bottom),
        }
    }

    /// Adds one line on a side; returns the line's column or row, `None` at the limit.
    fn step_outward(&mut self, side: Side, limit: Self) -> Option<usize> {
        let (at_limit, edge, outward) = match side {
            Side::Left => (self.left <= limit.left, &mut self.left, false),
            Side::Right => (self.right >= limit.right, &mut self.right, true),
            Side::Top => (self.top <= limit.top, &mut self.top, false),
            Side::Bottom => (self.bottom >= limit.bottom, &mut self.bottom, true),
        };
        if at_limit {
            return None;
        }
        if outward {
            *edge += 1;
            Some(*edge - 1)
        } else {
            *edge -= 1;
            Some(*edge)
        }
    }

    /// The column or row that lies `inward` lines inside a side.
    fn line_inside(&self, side: Side, inward: usize) -> Option<usize> {
        let line = match side {
            Side::Left => self.left + inward,
            Side::Top => self.top + inward,
            Side::Right => self.right.checked_sub(inward + 1)?,
            Side::Bottom => self.bottom.checked_sub(inward + 1)?,
        };
        let lines = match side {
            Side::Left | Side::Right => self.left..self.right,
            Side::Top | Side::Bottom => self.top..self.bottom,
        };
        lines.contains(&line).then_some(line)
    }

    fn length_of(&self, side: Side) -> usize {
        match side {
            Side::Left | Side::Right => self.bottom - self.top,
            Side::Top | Side::Bottom => self.right - self.left,
        }
    }

    /// Pixel (u, v) at position `along` a line.
    fn pixel(&self, side: Side, line: usize, along: usize) -> (usize, usize) {
        match side {
            Side::Left | Side::Right => (line, self.top + along),
            Side::Top | Side::Bottom => (self.left + along, line),
        }
    }
}

/// The box with only those sides moved that differ between the two windows.
fn widened(bounding_box: &BoundingBox, start: Window, end: Window) -> BoundingBox {
    let choose = |moved: bool, to: usize, from: f32| if moved { to as f32 } else { from };
    BoundingBox::new(
        choose(end.left < start.left, end.left, bounding_box.x_min()),
        choose(end.top < start.top, end.top, bounding_box.y_min()),
        choose(end.right > start.right, end.right, bounding_box.x_max()),
        choose(end.bottom > start.bottom, end.bottom, bounding_box.y_max()),
    )
    .unwrap_or(*bounding_box)
}

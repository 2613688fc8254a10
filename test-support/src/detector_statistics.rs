use dymlm_core::{BoundingBox, Detection, Mask};

/// Statistics of a 2D detector's errors on things whose exact boxes are known: gathers simulated or recorded
/// frames, and gives [`DetectorFigures`]. The simulated detector's defaults were set with it.
///
/// Only boxes of one label count. In each frame, boxes are matched to views in the order of their scores:
/// each takes the free view with the largest `IoU`, if that is at least 0.3 (the matching of PASCAL VOC with
/// a lower threshold, so that cut boxes are measured too). A view is found at a score when a box of at least
/// that score took it; boxes without a view are surplus. O(boxes x views + pixels) a frame.
///
/// ```
/// use dymlm_core::{BoundingBox, Detection, Mask};
/// use dymlm_test_support::{DetectorStatistics, ExactView};
///
/// // A person fills columns 2 to 5 of an image of 8 x 4 pixels; the box misses the last of them.
/// let person = Mask::new(8, 4, (0..32).map(|pixel| (2..6).contains(&(pixel % 8))).collect())?;
/// let view = ExactView::of_mask(1, &person).ok_or("a view")?;
/// let found = Detection::new("person", 0.6, BoundingBox::new(2.0, 0.0, 5.0, 4.0)?)?;
///
/// let mut statistics = DetectorStatistics::new("person");
/// statistics.add(&[found], &[view], &person);
/// let figures = statistics.figures().ok_or("there was a view")?;
/// assert_eq!(figures.found, [1.0, 1.0, 0.0]);
/// assert_eq!(figures.pixels_outside, 0.25);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct DetectorStatistics {
    label: String,
    frames: usize,
    views: Vec<Viewed>,
    boxes: usize,
    pixels: u64,
    pixels_outside: u64,
    /// The things that were missed in the last frame, and how many frames each has been missed.
    missing: Vec<Missing>,
    /// Number of bursts of misses that have ended, by length minus one.
    bursts: Vec<usize>,
}

/// A thing's exact view in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactView {
    /// Identifies the thing across frames.
    pub id: usize,
    /// Smallest box around the pixels that show it.
    pub bounding_box: BoundingBox,
    /// Number of pixels that show it.
    pub pixels: usize,
}

/// The results of [`DetectorStatistics`].
///
/// Shares are 0..=1. Figures of boxes are taken over the views that were found.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectorFigures {
    /// Number of frames.
    pub frames: usize,
    /// Number of views of things.
    pub views: usize,
    /// Number of boxes of the label.
    pub boxes: usize,
    /// Share of views found at a score of at least 0.25, 0.5 and 0.7.
    pub found: [f64; 3],
    /// The same for each size of views, smallest first; sizes without views are left out.
    pub by_size: Vec<SizeFigures>,
    /// Share of views not found that a box of another label covers (`IoU` of at least 0.5).
    pub confused: f64,
    /// Quartiles of the score.
    pub score_quartiles: [f64; 3],
    /// `IoU` with the exact box that half and nine tenths of the boxes reach.
    pub iou: [f64; 2],
    /// Left, top, right and lower side.
    pub sides: [SideFigures; 4],
    /// Share of the things' pixels outside all boxes of the label.
    pub pixels_outside: f64,
    /// Number of boxes without a view, for each view.
    pub surplus: f64,
    /// Number of bursts of 1, 2, 3 ... frames in which a thing was in view and not found.
    pub bursts: Vec<usize>,
    /// Mean length of a burst, frames; 0 without any.
    pub mean_burst: f64,
}

/// Views of about one size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeFigures {
    /// Smallest and, excluded, largest share of the image that the views cover.
    pub image_share: [f64; 2],
    /// Number of views.
    pub views: usize,
    /// Share of these views found at a score of at least 0.25, 0.5 and 0.7.
    pub found: [f64; 3],
}

/// Distances of one side of the boxes from the exact side, in units of the exact box's extent across that
/// side; positive inwards, where the box is cut. Sides of the exact box at the image border do not count. All
/// 0 without any sides.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SideFigures {
    /// Number of sides.
    pub count: usize,
    /// Median and 90 % quantile of the absolute distance.
    pub distance: [f64; 2],
    /// 5 %, 25 %, 50 %, 75 % and 95 % quantiles of the signed distance.
    pub quantiles: [f64; 5],
    /// Share of sides that are more than a tenth of the extent inwards.
    pub cut: f64,
}

/// A line of a table of figures.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureRow {
    /// Name of the figure, with its unit.
    pub name: String,
    /// Its value.
    pub value: f64,
}

/// A view and its result.
#[derive(Debug, Clone, Copy)]
struct Viewed {
    image_share: f64,
    found: Option<Found>,
    confused: bool,
}

#[derive(Debug, Clone, Copy)]
struct Found {
    score: f64,
    iou: f64,
    /// `None` for sides at the image border.
    sides: [Option<f64>; 4],
}

#[derive(Debug, Clone, Copy)]
struct Missing {
    id: usize,
    frames: usize,
}

/// Least `IoU` of a box and the view that it takes.
const MIN_IOU: f64 = 0.3;
/// Least `IoU` at which a box of another label counts as the view with a wrong label.
const MIN_CONFUSED_IOU: f64 = 0.5;
/// The scores at which views are counted as found.
const SCORES: [f64; 3] = [0.25, 0.5, 0.7];
/// Bounds of the size classes of views, as shares of the image; the smallest class is slivers below 5000
/// pixels of 640x480.
const SIZES: [f64; 5] = [0.0, 5000.0 / (640.0 * 480.0), 0.05, 0.1, 1.01];
/// Share of the extent above which a side counts as cut.
const CUT: f64 = 0.1;

impl ExactView {
    /// A view whose exact box is known.
    pub fn new(id: usize, bounding_box: BoundingBox, pixels: usize) -> Self {
        Self { id, bounding_box, pixels }
    }

    /// The view that a mask shows; `None` when the mask is empty.
    pub fn of_mask(id: usize, mask: &Mask) -> Option<Self> {
        let (mut x, mut y) = ([usize::MAX, 0], [usize::MAX, 0]);
        let mut pixels = 0;
        for v in 0..mask.height() {
            for u in mask.columns_of_row(v) {
                pixels += 1;
                x = [x[0].min(u), x[1].max(u + 1)];
                y = [y[0].min(v), y[1].max(v + 1)];
            }
        }
        let bounding_box = BoundingBox::new(x[0] as f32, y[0] as f32, x[1] as f32, y[1] as f32).ok()?;
        Some(Self { id, bounding_box, pixels })
    }
}

impl DetectorStatistics {
    /// Statistics of the boxes of one label.
    pub fn new(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            frames: 0,
            views: Vec::new(),
            boxes: 0,
            pixels: 0,
            pixels_outside: 0,
            missing: Vec::new(),
            bursts: Vec::new(),
        }
    }

    /// Adds the next frame: what the detector found, all views of things of the label, and the pixels that
    /// show any of them (its size is the image's).
    pub fn add(&mut self, detections: &[Detection], views: &[ExactView], shown: &Mask) {
        let size = [shown.width(), shown.height()];
        let boxes: Vec<&Detection> = self.of_label(detections);
        let found = matched(&boxes, views, size);
        self.frames += 1;
        self.boxes += boxes.len();
        self.count_pixels(&boxes, shown);
        self.count_bursts(views, &found);
        for (view, found) in views.iter().zip(found) {
            let covers = |d: &Detection| {
                d.label() != self.label && d.bounding_box().iou(&view.bounding_box) >= MIN_CONFUSED_IOU
            };
            self.views.push(Viewed {
                image_share: view.pixels as f64 / (size[0] * size[1]) as f64,
                found,
                confused: found.is_none() && detections.iter().any(covers),
            });
        }
    }

    /// The figures of all frames so far; `None` when no view was among them.
    pub fn figures(&self) -> Option<DetectorFigures> {
        if self.views.is_empty() {
            return None;
        }
        let found: Vec<Found> = self.views.iter().filter_map(|view| view.found).collect();
        let scores = sorted(found.iter().map(|found| found.score));
        let overlaps = sorted(found.iter().map(|found| found.iou));
        let missed = self.views.len() - found.len();
        let confused = self.views.iter().filter(|view| view.confused).count();
        let bursts = self.all_bursts();
        let count: usize = bursts.iter().sum();
        let missed_frames: usize = bursts.iter().zip(1..).map(|(bursts, frames)| bursts * frames).sum();
        Some(DetectorFigures {
            frames: self.frames,
            views: self.views.len(),
            boxes: self.boxes,
            found: SCORES.map(|score| found_share(&self.views, score)),
            by_size: self.by_size(),
            confused: share(confused, missed),
            score_quartiles: [0.25, 0.5, 0.75].map(|p| quantile(&scores, p)),
            iou: [0.5, 0.1].map(|p| quantile(&overlaps, p)),
            sides: std::array::from_fn(|side| side_figures(found.iter().filter_map(|f| f.sides[side]))),
            pixels_outside: self.pixels_outside as f64 / (self.pixels as f64).max(1.0),
            surplus: share(self.boxes - found.len(), self.views.len()),
            mean_burst: share(missed_frames, count),
            bursts,
        })
    }

    /// The boxes of the label, highest score first; of equal scores the first given.
    fn of_label<'a>(&self, detections: &'a [Detection]) -> Vec<&'a Detection> {
        let mut boxes: Vec<&Detection> = detections.iter().filter(|d| d.label() == self.label).collect();
        boxes.sort_by(|a, b| b.score().total_cmp(&a.score()));
        boxes
    }

    fn count_pixels(&mut self, boxes: &[&Detection], shown: &Mask) {
        let areas: Vec<_> = boxes
            .iter()
            .map(|d| (d.bounding_box().columns(shown.width()), d.bounding_box().rows(shown.height())))
            .collect();
        for v in 0..shown.height() {
            for u in shown.columns_of_row(v) {
                let covered = areas.iter().any(|(columns, rows)| columns.contains(&u) && rows.contains(&v));
                self.pixels += 1;
                self.pixels_outside += u64::from(!covered);
            }
        }
    }

    fn count_bursts(&mut self, views: &[ExactView], found: &[Option<Found>]) {
        let before = std::mem::take(&mut self.missing);
        let missed = views.iter().zip(found).filter(|(_, found)| found.is_none());
        self.missing = missed
            .map(|(view, _)| {
                let earlier = before.iter().find(|missing| missing.id == view.id);
                Missing { id: view.id, frames: 1 + earlier.map_or(0, |missing| missing.frames) }
            })
            .collect();
        for ended in before.iter().filter(|old| !self.missing.iter().any(|new| new.id == old.id)) {
            count_burst(&mut self.bursts, ended.frames);
        }
    }

    /// The bursts that have ended, and those that the last frame cut off.
    fn all_bursts(&self) -> Vec<usize> {
        let mut bursts = self.bursts.clone();
        self.missing.iter().for_each(|missing| count_burst(&mut bursts, missing.frames));
        bursts
    }

    fn by_size(&self) -> Vec<SizeFigures> {
        let sizes = SIZES.windows(2).map(|range| {
            let image_share = [range[0], range[1]];
            let within = |view: &&Viewed| (image_share[0]..image_share[1]).contains(&view.image_share);
            let views: Vec<Viewed> = self.views.iter().filter(within).copied().collect();
            let found = SCORES.map(|score| found_share(&views, score));
            SizeFigures { image_share, views: views.len(), found }
        });
        sizes.filter(|size| size.views > 0).collect()
    }
}

impl DetectorFigures {
    /// All figures as lines of a table, the same lines for any detector; shares in percent.
    pub fn rows(&self) -> Vec<FigureRow> {
        let mut rows = Vec::new();
        let mut row = |name: String, value: f64| rows.push(FigureRow { name, value });
        row("frames".into(), self.frames as f64);
        row("views".into(), self.views as f64);
        for (score, found) in SCORES.iter().zip(self.found) {
            row(format!("found at score {score}, %"), 100.0 * found);
        }
        for range in SIZES.windows(2) {
            let size = self.by_size.iter().find(|size| size.image_share == [range[0], range[1]]);
            let name = format!("{:.1} to {:.0} % of the image", 100.0 * range[0], 100.0 * range[1].min(1.0));
            row(format!("views of {name}"), size.map_or(0.0, |size| size.views as f64));
            row(format!("found of {name}, %"), size.map_or(f64::NAN, |size| 100.0 * size.found[0]));
        }
        row("named something else, of the missed, %".into(), 100.0 * self.confused);
        for (quartile, score) in
            ["lower quartile", "median", "upper quartile"].iter().zip(self.score_quartiles)
        {
            row(format!("score, {quartile}"), score);
        }
        row("IoU, median".into(), self.iou[0]);
        row("IoU that 90 % reach".into(), self.iou[1]);
        for (side, figures) in ["left", "top", "right", "lower"].iter().zip(&self.sides) {
            row(format!("{side} side, median distance, % of the extent"), 100.0 * figures.distance[0]);
            row(format!("{side} side, 90 % within, % of the extent"), 100.0 * figures.distance[1]);
            row(format!("{side} side cut by a tenth, %"), 100.0 * figures.cut);
        }
        row("pixels outside all boxes, %".into(), 100.0 * self.pixels_outside);
        row("surplus boxes, % of the views".into(), 100.0 * self.surplus);
        let bursts: usize = self.bursts.iter().sum();
        row("bursts of misses".into(), bursts as f64);
        row("mean length of a burst, frames".into(), self.mean_burst);
        row("longest burst, frames".into(), self.bursts.len() as f64);
        rows
    }
}

/// For each view, the box that takes it. `boxes` are sorted by descending score.
fn matched(boxes: &[&Detection], views: &[ExactView], size: [usize; 2]) -> Vec<Option<Found>> {
    let mut found: Vec<Option<Found>> = vec![None; views.len()];
    for detection in boxes {
        let area = detection.bounding_box();
        let free = views.iter().enumerate().filter(|&(k, _)| found[k].is_none());
        let best = free
            .map(|(k, view)| (k, view, area.iou(&view.bounding_box)))
            .filter(|&(_, _, iou)| iou >= MIN_IOU)
            .max_by(|a, b| a.2.total_cmp(&b.2));
        if let Some((k, view, iou)) = best {
            let sides = side_errors(&area, &view.bounding_box, size);
            found[k] = Some(Found { score: detection.score().into(), iou, sides });
        }
    }
    found
}

/// How far inwards each side lies, relative to the extent; `None` where the exact side is at the image
/// border.
fn side_errors(area: &BoundingBox, exact: &BoundingBox, size: [usize; 2]) -> [Option<f64>; 4] {
    let [found, exact] = [area, exact].map(|b| <[f32; 4]>::from(*b).map(f64::from));
    let extent = [exact[2] - exact[0], exact[3] - exact[1]];
    std::array::from_fn(|side| {
        let axis = side % 2;
        let (border, inwards) = if side < 2 { (0.0, 1.0) } else { (size[axis] as f64, -1.0) };
        let within = (exact[side] - border) * inwards > 0.0;
        within.then(|| (found[side] - exact[side]) * inwards / extent[axis].max(1e-6))
    })
}

fn side_figures(errors: impl Iterator<Item = f64>) -> SideFigures {
    let signed = sorted(errors);
    let distances = sorted(signed.iter().map(|error| error.abs()));
    SideFigures {
        count: signed.len(),
        distance: [0.5, 0.9].map(|p| quantile(&distances, p)),
        quantiles: [0.05, 0.25, 0.5, 0.75, 0.95].map(|p| quantile(&signed, p)),
        cut: share(signed.iter().filter(|&&error| error > CUT).count(), signed.len()),
    }
}

fn found_share(views: &[Viewed], score: f64) -> f64 {
    // Scores are f32; 0.7 in f32 is a little less than in f64.
    let found = views.iter().filter(|view| view.found.is_some_and(|found| found.score >= score - 1e-6));
    share(found.count(), views.len())
}

fn count_burst(bursts: &mut Vec<usize>, frames: usize) {
    bursts.resize(bursts.len().max(frames), 0);
    if let Some(count) = frames.checked_sub(1).and_then(|k| bursts.get_mut(k)) {
        *count += 1;
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The `p` quantile of sorted values (the nearest rank); 0 without values.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let rank = (sorted.len().saturating_sub(1) as f64 * p).round() as usize;
    sorted.get(rank).copied().unwrap_or(0.0)
}

fn share(part: usize, whole: usize) -> f64 {
    if whole > 0 { part as f64 / whole as f64 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Mask {
        let shows = |pixel: usize| columns.contains(&(pixel % 40)) && rows.contains(&(pixel / 40));
        Mask::new(40, 30, (0..40 * 30).map(shows).collect()).unwrap()
    }

    fn found(label: &str, score: f32, sides: [f32; 4]) -> Detection {
        Detection::new(label, score, BoundingBox::try_from(sides).unwrap()).unwrap()
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-6
    }

    #[test]
    fn a_view_is_the_bounds_of_its_mask() {
        let view = ExactView::of_mask(7, &mask(3..9, 10..30)).unwrap();
        assert_eq!(view, ExactView::new(7, BoundingBox::new(3.0, 10.0, 9.0, 30.0).unwrap(), 120));
        assert_eq!(ExactView::of_mask(7, &mask(3..3, 0..0)), None);
    }

    #[test]
    fn without_views_there_are_no_figures() {
        let mut statistics = DetectorStatistics::new("person");
        assert_eq!(statistics.figures(), None);
        statistics.add(&[found("person", 0.9, [0.0, 0.0, 5.0, 5.0])], &[], &mask(0..0, 0..0));
        assert_eq!(statistics.figures(), None);
    }

    #[test]
    fn one_box_is_not_found_for_two_people() {
        // Two people side by side in one box: it counts for the larger view.
        let (left, right) = (mask(4..14, 0..20), mask(14..18, 0..20));
        let views = [ExactView::of_mask(0, &left).unwrap(), ExactView::of_mask(1, &right).unwrap()];
        let both = found("person", 0.8, [4.0, 0.0, 18.0, 20.0]);
        let mut statistics = DetectorStatistics::new("person");
        statistics.add(&[both], &views, &mask(4..18, 0..20));
        let figures = statistics.figures().unwrap();
        assert_eq!((figures.views, figures.found, figures.surplus), (2, [0.5; 3], 0.0));
        assert_eq!(figures.pixels_outside, 0.0);
        assert!(near(figures.iou[0], 10.0 / 14.0));
    }

    #[test]
    fn the_better_box_takes_the_view_and_the_other_is_surplus() {
        let person = mask(10..20, 5..25);
        let view = ExactView::of_mask(0, &person).unwrap();
        let weak = found("person", 0.4, [10.0, 5.0, 20.0, 25.0]);
        let good = found("person", 0.6, [10.0, 5.0, 20.0, 20.0]);
        let mut statistics = DetectorStatistics::new("person");
        statistics.add(&[weak, good], &[view], &person);
        let figures = statistics.figures().unwrap();
        assert_eq!((figures.found, figures.surplus, figures.boxes), ([1.0, 1.0, 0.0], 1.0, 2));
        assert!(near(figures.iou[0], 0.75) && near(figures.score_quartiles[1], 0.6));
    }

    #[test]
    fn sides_are_measured_inwards_and_not_at_the_border() {
        // The exact box: columns 10 to 20, rows 0 to 20, with its upper side at the image border.
        let person = mask(10..20, 0..20);
        let view = ExactView::of_mask(0, &person).unwrap();
        let mut statistics = DetectorStatistics::new("person");
        statistics.add(&[found("person", 0.9, [12.0, 3.0, 20.5, 16.0])], &[view], &person);
        let [left, top, right, low] = statistics.figures().unwrap().sides;
        assert!(near(left.quantiles[2], 0.2) && near(left.cut, 1.0));
        assert_eq!(top, SideFigures::default());
        assert!(near(right.quantiles[2], -0.05) && near(right.distance[0], 0.05) && near(right.cut, 0.0));
        assert!(near(low.quantiles[2], 0.2) && low.count == 1);
        // Rows 3 to 15 of columns 12 to 19 are covered.
        assert!(near(statistics.figures().unwrap().pixels_outside, 1.0 - 8.0 * 13.0 / 200.0));
    }

    #[test]
    fn bursts_end_when_a_thing_is_found_or_leaves() {
        let person = mask(10..20, 0..20);
        let view = |id| ExactView { id, ..ExactView::of_mask(0, &person).unwrap() };
        let there = found("person", 0.9, [10.0, 0.0, 20.0, 20.0]);
        let mut statistics = DetectorStatistics::new("person");
        // Thing 0: missed twice, found, missed once, gone, missed once at the end.
        for (detections, views) in [
            (vec![], vec![view(0)]),
            (vec![], vec![view(0)]),
            (vec![there.clone()], vec![view(0)]),
            (vec![], vec![view(0)]),
            (vec![], vec![]),
            (vec![], vec![view(0), view(3)]),
        ] {
            statistics.add(&detections, &views, &person);
        }
        let figures = statistics.figures().unwrap();
        assert_eq!(figures.bursts, [3, 1]);
        assert!(near(figures.mean_burst, 5.0 / 4.0) && near(figures.found[0], 1.0 / 6.0));
        // Asking for figures ends no burst.
        assert_eq!(statistics.figures().unwrap(), figures);
    }

    #[test]
    fn things_under_another_name_are_missed_and_said_to_be() {
        let person = mask(10..20, 0..20);
        let view = ExactView::of_mask(0, &person).unwrap();
        let mut statistics = DetectorStatistics::new("person");
        statistics.add(&[found("dog", 0.9, [10.0, 0.0, 20.0, 18.0])], &[view], &person);
        statistics.add(&[], &[view], &person);
        let figures = statistics.figures().unwrap();
        assert_eq!((figures.found[0], figures.confused, figures.boxes), (0.0, 0.5, 0));
        assert_eq!(figures.pixels_outside, 1.0);
        assert_eq!((figures.iou, figures.score_quartiles), ([0.0; 2], [0.0; 3]));
    }

    #[test]
    fn tables_of_two_detectors_have_the_same_lines() {
        let names = |columns| {
            let person = mask(columns, 0..20);
            let mut statistics = DetectorStatistics::new("person");
            statistics.add(&[], &[ExactView::of_mask(0, &person).unwrap()], &person);
            statistics.figures().unwrap().rows().into_iter().map(|row| row.name).collect::<Vec<_>>()
        };
        assert_eq!(names(0..2), names(0..30));
    }
}

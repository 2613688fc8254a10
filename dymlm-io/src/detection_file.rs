use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use dymlm_core::{Detection, PackedDetection, RunLengths};
use serde::{Deserialize, Serialize};

use crate::text_lines::{content_lines, number};
use crate::tum::association::associate;
use crate::{Error, write_atomically};

/// The detections of a sequence: `detections.jsonl` has one JSON object per line, for one frame:
///
/// ```json
/// {"timestamp": 0.166667, "detections": [{"label": "person", "score": 0.91, "bbox": [210.0, 8.0, 380.0, 480.0]}]}
/// ```
///
/// Boxes are `[x_min, y_min, x_max, y_max]` in pixels of the colour image. A detection may have an instance
/// mask of the image's size as COCO's run lengths, `"mask": {"size": [height, width], "counts": ...}`, where
/// counts are COCO's compressed string or a list of numbers. Other keys, blank lines and lines that begin
/// with `#` are ignored.
///
/// A line with an empty list says that the detector ran and found nothing; it did not run on a frame without
/// a line.
///
/// The masks of a line may take 512 MiB at most when they are decoded, a bit for each pixel.
///
/// A bad line affects only its own frame: [`Self::at`] returns the error for that frame. The frame is found
/// by the line's timestamp or, when even that cannot be read, by the lines before and after.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("detections.jsonl");
/// std::fs::write(&path, r#"{"timestamp": 0.0, "detections": []}
/// {"timestamp": 0.1, "detections": [{"label": "person", "score": 0.9, "bbox": [1, 2, 30, 40]}]}
/// {"timestamp": 0.2, "detections": [{"label": "person", "score"#)?;
///
/// let file = dymlm_io::DetectionFile::open(&path, dymlm_io::DetectionFile::DEFAULT_TOLERANCE)?;
/// assert_eq!(file.at(0.0)?.map(|found| found.len()), Some(0), "nothing was found");
/// assert_eq!(file.at(0.1)?.map(|found| found.len()), Some(1));
/// assert!(file.at(0.2).unwrap_err().to_string().contains("detections.jsonl, line 3"));
/// assert_eq!(file.at(7.0)?, None, "the file does not speak of that frame");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct DetectionFile {
    path: PathBuf,
    tolerance: f64,
    /// In time order.
    frames: Vec<DetectedFrame>,
    /// Bad lines without a timestamp.
    unplaced: Vec<UnplacedLine>,
}

/// Most memory of the decoded masks of a frame, bytes: 130 masks of 8192 x 4096 pixels.
const MAX_MASK_BYTES: u64 = 1 << 29;

/// What a detector found in the frame of one time.
#[derive(Debug, Clone)]
struct DetectedFrame {
    timestamp: f64,
    line: usize,
    /// The detections, or what is wrong with the line. Masks are decoded when the frame is asked for: those
    /// of a whole recording take gigabytes.
    detections: Result<Vec<PackedDetection>, String>,
}

/// A bad line without a readable timestamp: its frame lies between those of its neighbours.
#[derive(Debug, Clone)]
struct UnplacedLine {
    line: usize,
    reason: String,
    after: f64,
    before: f64,
}

impl DetectionFile {
    /// Half a frame at 25 Hz, seconds: the largest time between a line and its frame that makes sense for
    /// common cameras. Colour and depth images are associated with the same limit.
    pub const DEFAULT_TOLERANCE: f64 = 0.02;

    /// Opens a detection file. A line belongs to a frame at most `tolerance` seconds away.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when the file cannot be read; [`Error::Config`] when `tolerance` is not within 0..=10.
    /// [`Self::at`] and [`Self::faults`] report bad lines.
    pub fn open(path: impl AsRef<Path>, tolerance: f64) -> Result<Self, Error> {
        dymlm_core::check_range("detections.tolerance", tolerance, 0.0..=10.0)?;
        let path = path.as_ref();
        let bytes = fs::read(path).map_err(Error::io(path))?;
        let mut file = Self { path: path.to_path_buf(), tolerance, frames: Vec::new(), unplaced: Vec::new() };
        for (line, content) in content_lines(&bytes) {
            file.add(line, content);
        }
        file.bound_unplaced_lines();
        // The sort is stable: of two lines with the same time, [`Self::at`] finds the first in the file.
        file.frames.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        Ok(file)
    }

    /// The detections of the frame whose colour image has this time: none when nothing was found, `None` when
    /// the file has no line for that frame. Masks are decoded anew by each call.
    ///
    /// The line nearest in time counts, though another frame may be nearer to it: with frames closer to each
    /// other than the tolerance, one line may be found for several. [`TumRecording`](crate::TumRecording)
    /// knows all its frames, and gives each line to one.
    ///
    /// # Errors
    ///
    /// [`Error::Line`] when the frame's line is a bad one.
    pub fn at(&self, timestamp: f64) -> Result<Option<Vec<Detection>>, Error> {
        self.found(self.nearest(timestamp), timestamp)
    }

    /// [`Self::at`] for a frame of [`Self::lines_of`], given its line there.
    pub(crate) fn at_line(
        &self,
        line: Option<usize>,
        timestamp: f64,
    ) -> Result<Option<Vec<Detection>>, Error> {
        self.found(line.and_then(|index| self.frames.get(index)), timestamp)
    }

    /// Which line each frame has, given the times of all frames of the recording: one to one, the closest
    /// pairs first. A detector that ran on every second frame of a fast camera has said nothing of the
    /// frames between, although these too are within the tolerance of its lines.
    pub(crate) fn lines_of(&self, times: &[f64]) -> Vec<Option<usize>> {
        // A frame's time is that of its colour image, and the frames are in the order of their depth images.
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
        let seen: Vec<f64> = order.iter().map(|&index| times[index]).collect();
        // Of lines with the same time only the first counts: the others must not go to the neighbours.
        let is_first = |&at: &usize| at == 0 || self.frames[at - 1].timestamp < self.frames[at].timestamp;
        let lines: Vec<usize> = (0..self.frames.len()).filter(is_first).collect();
        let said: Vec<f64> = lines.iter().map(|&at| self.frames[at].timestamp).collect();
        let mut found = vec![None; times.len()];
        for pair in associate(&seen, &said, self.tolerance) {
            found[order[pair.color]] = Some(lines[pair.depth]);
        }
        found
    }

    /// The detections of a frame's line or, without one, the error of a line that may be the frame's.
    fn found(&self, frame: Option<&DetectedFrame>, timestamp: f64) -> Result<Option<Vec<Detection>>, Error> {
        if let Some(frame) = frame {
            return match &frame.detections {
                Ok(detections) => Ok(Some(detections.iter().map(PackedDetection::unpacked).collect())),
                Err(reason) => Err(Error::line(&self.path, frame.line, reason)),
            };
        }
        let lost = self.unplaced.iter().find(|lost| lost.after < timestamp && timestamp < lost.before);
        lost.map_or(Ok(None), |lost| Err(Error::line(&self.path, lost.line, &lost.reason)))
    }

    /// Number of lines that are not blank or comments, good or bad.
    pub fn len(&self) -> usize {
        self.frames.len() + self.unplaced.len()
    }

    /// Whether the file has no such line.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The bad lines, in the order of the file.
    pub fn faults(&self) -> Vec<Error> {
        let placed =
            self.frames.iter().filter_map(|frame| Some((frame.line, frame.detections.as_ref().err()?)));
        let unplaced = self.unplaced.iter().map(|lost| (lost.line, &lost.reason));
        let mut faults: Vec<_> = placed.chain(unplaced).collect();
        faults.sort_by_key(|&(line, _)| line);
        faults.into_iter().map(|(line, reason)| Error::line(&self.path, line, reason)).collect()
    }

    fn add(&mut self, line: usize, content: Result<&str, String>) {
        let text = content.as_ref().copied().ok();
        let parsed = content.and_then(|content| {
            let frame = serde_json::from_str::<ReadFrame>(content).map_err(|error| json_reason(&error))?;
            check_masks(&frame.detections)?;
            Ok(frame)
        });
        match parsed {
            Ok(ReadFrame { timestamp, detections }) => {
                self.frames.push(DetectedFrame { timestamp, line, detections: Ok(detections) });
            }
            Err(reason) => match text.and_then(find_timestamp) {
                Some(timestamp) => {
                    self.frames.push(DetectedFrame { timestamp, line, detections: Err(reason) });
                }
                None => self.unplaced.push(UnplacedLine {
                    line,
                    reason,
                    after: f64::NEG_INFINITY,
                    before: f64::INFINITY,
                }),
            },
        }
    }

    /// Bounds the times of lines without a timestamp by their neighbours; `frames` is still in the order of
    /// the file.
    fn bound_unplaced_lines(&mut self) {
        for lost in &mut self.unplaced {
            let next = self.frames.partition_point(|frame| frame.line < lost.line);
            if let Some(before) = self.frames.get(next) {
                lost.before = before.timestamp;
            }
            if let Some(after) = next.checked_sub(1).and_then(|previous| self.frames.get(previous)) {
                lost.after = after.timestamp;
            }
        }
    }

    fn nearest(&self, timestamp: f64) -> Option<&DetectedFrame> {
        // The first line of the file with the nearest earlier time, and the first with the nearest later
        // time.
        let first_from = |time: f64| self.frames.partition_point(|frame| frame.timestamp < time);
        let after = first_from(timestamp);
        let before = after.checked_sub(1).and_then(|last| self.frames.get(last));
        let before = before.map(|last| first_from(last.timestamp));
        let distance = |frame: &&DetectedFrame| (frame.timestamp - timestamp).abs();
        before
            .into_iter()
            .chain([after])
            .filter_map(|index| self.frames.get(index))
            .filter(|frame| distance(frame) <= self.tolerance)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// Writes one line of a `detections.jsonl`.
///
/// # Errors
///
/// Those of the stream; a timestamp that is not finite is invalid input.
pub fn encode_detections(out: &mut dyn Write, timestamp: f64, detections: &[Detection]) -> io::Result<()> {
    if !timestamp.is_finite() {
        let error = dymlm_core::Error::Timestamp(timestamp);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, error));
    }
    serde_json::to_writer(&mut *out, &WrittenFrame { timestamp, detections })?;
    out.write_all(b"\n")
}

/// Writes a whole `detections.jsonl`, atomically: timestamp and detections of each frame.
///
/// # Errors
///
/// As [`write_atomically`] and [`encode_detections`].
pub fn write_detections<'a>(
    path: impl AsRef<Path>,
    frames: impl IntoIterator<Item = (f64, &'a [Detection])>,
) -> Result<(), Error> {
    write_atomically(path, |out| {
        frames
            .into_iter()
            .try_for_each(|(timestamp, detections)| encode_detections(out, timestamp, detections))
    })
}

#[derive(Deserialize)]
struct ReadFrame {
    timestamp: f64,
    detections: Vec<PackedDetection>,
}

#[derive(Serialize)]
struct WrittenFrame<'a> {
    timestamp: f64,
    detections: &'a [Detection],
}

/// Refuses a line whose masks would take too much memory together: a line of 100 kB can hold a thousand masks
/// that claim 33 MB each.
fn check_masks(detections: &[PackedDetection]) -> Result<(), String> {
    let masks = detections.iter().filter_map(PackedDetection::mask);
    let bytes: u64 = masks.map(RunLengths::mask_bytes).sum();
    if bytes <= MAX_MASK_BYTES {
        return Ok(());
    }
    Err(format!("masks of {bytes} bytes together, of which at most {MAX_MASK_BYTES} are decoded"))
}

/// The parser's reason, without its line number, which is always 1.
fn json_reason(error: &serde_json::Error) -> String {
    error.to_string().replace(" at line 1 column ", " at column ")
}

/// The timestamp of a line that is no valid JSON otherwise.
fn find_timestamp(line: &str) -> Option<f64> {
    let (_, rest) = line.split_once("\"timestamp\"")?;
    let value = rest.trim_start().strip_prefix(':')?.trim_start();
    // Without a character after it, the number itself may be cut short.
    let end = value.find(|c: char| !matches!(c, '0'..='9' | '+' | '-' | '.' | 'e' | 'E'))?;
    number(value.get(..end)?).ok()
}

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use dymlm_core::{BoundingBox, Detection};

use crate::Error;
use crate::text_lines::{content_lines, number, quoted};

/// A folder of YOLO text files, one per image and named after it: `rgb/000005.jpg` has `000005.txt`.
///
/// A line is `class cx cy w h [score]`: the class's number from 0, the box's centre and size as fractions of
/// the image's width and height, and the score, which is 1 if left out. An image without a file has no
/// detections, since detectors write no empty files.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// std::fs::write(folder.path().join("000005.txt"), "0 0.5 0.5 0.25 1.0 0.8\n")?;
///
/// let names = vec!["person".to_owned(), "bicycle".to_owned()];
/// let yolo = dymlm_io::YoloFolder::open(folder.path(), names, 640, 480)?;
/// let found = yolo.read("rgb/000005.jpg")?;
/// assert_eq!(found[0].label(), "person");
/// assert_eq!(<[f32; 4]>::from(found[0].bounding_box()), [240.0, 0.0, 400.0, 480.0]);
/// assert!(yolo.read("rgb/000006.jpg")?.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct YoloFolder {
    folder: PathBuf,
    names: Vec<String>,
    width: usize,
    height: usize,
}

/// Reads class names, one per line, from class 0 on; empty lines at the end are ignored.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] when the file is not UTF-8.
pub fn read_class_names(path: impl AsRef<Path>) -> Result<Vec<String>, Error> {
    let path = path.as_ref();
    let bytes = fs::read(path).map_err(Error::io(path))?;
    let text = String::from_utf8(bytes).map_err(|_| Error::malformed(path, "no UTF-8"))?;
    // Editors may begin a file with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    Ok(text.trim_end().lines().map(|name| name.trim().to_owned()).collect())
}

impl YoloFolder {
    /// Opens a folder whose classes are called `names` and whose images have `width` x `height` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when the folder cannot be read; [`Error::Config`] when width or height is 0.
    pub fn open(
        folder: impl AsRef<Path>,
        names: Vec<String>,
        width: usize,
        height: usize,
    ) -> Result<Self, Error> {
        dymlm_core::check_range("yolo.width", width as f64, 1.0..=f64::MAX)?;
        dymlm_core::check_range("yolo.height", height as f64, 1.0..=f64::MAX)?;
        let folder = folder.as_ref();
        fs::read_dir(folder).map_err(Error::io(folder))?;
        Ok(Self { folder: folder.to_path_buf(), names, width, height })
    }

    /// The detections in an image, given by its path. Only the file name without its extension matters.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Line`] for the first bad line.
    pub fn read(&self, image: impl AsRef<Path>) -> Result<Vec<Detection>, Error> {
        let Some(stem) = image.as_ref().file_stem() else {
            return Ok(Vec::new());
        };
        let mut name = stem.to_os_string();
        name.push(".txt");
        let path = self.folder.join(name);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(Error::io(&path)(error)),
        };
        content_lines(&bytes)
            .map(|(line, content)| {
                content
                    .and_then(|content| self.parse(content))
                    .map_err(|reason| Error::line(&path, line, reason))
            })
            .collect()
    }

    /// `class cx cy w h [score]`.
    fn parse(&self, line: &str) -> Result<Detection, String> {
        let columns: Vec<&str> = line.split_ascii_whitespace().collect();
        let (class, rest) = match columns.as_slice() {
            [class, rest @ ..] if matches!(rest.len(), 4 | 5) => (class, rest),
            _ => return Err(format!("{} columns instead of class cx cy w h [score]", columns.len())),
        };
        let label = class
            .parse::<usize>()
            .ok()
            .and_then(|class| self.names.get(class))
            .ok_or_else(|| format!("class {} of {} names", quoted(class), self.names.len()))?;
        let mut values = [0.0, 0.0, 0.0, 0.0, 1.0];
        for (value, column) in values.iter_mut().zip(rest) {
            *value = number(column)?;
        }
        let [cx, cy, w, h, score] = values;
        // Detectors round; a box that exceeds the image by more than a hundredth is not normalized.
        if [cx, cy, w, h].iter().any(|part| !(-0.01..=1.01).contains(part)) {
            return Err(format!("the box {cx} {cy} {w} {h} is not in parts of the image (0..=1)"));
        }
        let (width, height) = (self.width as f64, self.height as f64);
        BoundingBox::new(
            ((cx - 0.5 * w) * width) as f32,
            ((cy - 0.5 * h) * height) as f32,
            ((cx + 0.5 * w) * width) as f32,
            ((cy + 0.5 * h) * height) as f32,
        )
        .and_then(|bounding_box| Detection::new(label.as_str(), score as f32, bounding_box))
        .map_err(|error| error.to_string())
    }
}

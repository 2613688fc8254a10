use std::path::Path;

use super::map_description::MapDescription;
use super::pgm::GrayImage;
use crate::{CellState, Error};

/// A 2D map from the files that ROS `map_server` reads, such as [`OccupancyGrid::save`] writes.
///
/// [`OccupancyGrid::save`]: crate::OccupancyGrid::save
#[derive(Debug, Clone, PartialEq)]
pub struct MapFile {
    /// Number of cells along x.
    pub width: usize,
    /// Number of cells along y.
    pub height: usize,
    /// Side of a cell, metres.
    pub resolution: f64,
    /// The lower left corner of cell (0, 0): x and y in metres, and the direction of the map's x axis, radians.
    pub origin: [f64; 3],
    /// All cells, row by row from the lowest y.
    pub cells: Vec<CellState>,
}

impl MapFile {
    /// Reads a `.yaml` file and the image that it names.
    ///
    /// ```
    /// # use dymlm_octree::{CellState, MapFile};
    /// # let folder = std::env::temp_dir().join(format!("dymlm-map-file-{}", std::process::id()));
    /// # std::fs::create_dir_all(&folder)?;
    /// # std::fs::write(folder.join("hall.pgm"), b"P2 2 1 255  0 254")?;
    /// # std::fs::write(folder.join("hall.yaml"), "image: hall.pgm\nresolution: 0.05\norigin: [1.0, 2.0, 0.0]\n\
    /// # negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")?;
    /// let map = MapFile::load(folder.join("hall.yaml"))?;
    /// assert_eq!((map.width, map.height, map.resolution), (2, 1, 0.05));
    /// assert_eq!(map.cells, [CellState::Occupied, CellState::Free]);
    /// # std::fs::remove_dir_all(folder)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Io`], which names the file, when one cannot be read; within an [`Error::File`] that names it,
    /// [`Error::MapFile`] when it is no map, or its mode is another one than `trinary`, and [`Error::GridSize`] when it
    /// is too large.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let bytes = |path: &Path| std::fs::read(path).map_err(|source| crate::files::at(path)(source.into()));
        let text = String::from_utf8(bytes(path)?)
            .map_err(|_| crate::files::at(path)(Error::MapFile("it is no text".to_owned())))?;
        let description = MapDescription::read(&text).map_err(crate::files::at(path))?;
        let image_path = path.parent().unwrap_or(Path::new("")).join(&description.image);
        let image = GrayImage::read(&bytes(&image_path)?).map_err(crate::files::at(&image_path))?;
        Ok(Self::of(&description, &image))
    }

    /// Reads a map from the text of its `.yaml` file and the bytes of its image.
    ///
    /// # Errors
    ///
    /// [`Error::MapFile`] and [`Error::GridSize`].
    pub fn read(description: &str, image: &[u8]) -> Result<Self, Error> {
        Ok(Self::of(&MapDescription::read(description)?, &GrayImage::read(image)?))
    }

    fn of(description: &MapDescription, image: &GrayImage) -> Self {
        let state = |value: u16| {
            let dark = if description.negate { value } else { image.most.saturating_sub(value) };
            let occupied = f64::from(dark) / f64::from(image.most.max(1));
            // As map_server compares.
            if occupied > description.occupied_thresh {
                CellState::Occupied
            } else if occupied < description.free_thresh {
                CellState::Free
            } else {
                CellState::Unknown
            }
        };
        // The image's first row is the highest y.
        let rows = image.pixels.chunks(image.width.max(1)).rev();
        Self {
            width: image.width,
            height: image.height,
            resolution: description.resolution,
            origin: description.origin,
            cells: rows.flatten().map(|&value| state(value)).collect(),
        }
    }
}

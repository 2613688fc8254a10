use std::io::Write;
use std::path::Path;

use super::OccupancyGrid;
use crate::{CellState, Error};

impl OccupancyGrid {
    /// Writes the image that `map_server` reads: binary PGM, the highest y on top; occupied 0, free 254,
    /// unknown 205.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_pgm(&self, mut writer: impl Write) -> Result<(), Error> {
        write!(writer, "P5\n{} {}\n255\n", self.width(), self.height())?;
        for row in self.cells.chunks_exact(self.width().max(1)).rev() {
            let row: Vec<u8> = row.iter().map(|&cell| gray(cell)).collect();
            writer.write_all(&row)?;
        }
        writer.flush()?;
        Ok(())
    }

    /// Writes the description that `map_server` reads beside the image named `image`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_yaml(&self, mut writer: impl Write, image: &str) -> Result<(), Error> {
        let image = image.replace('\\', "\\\\").replace('"', "\\\"");
        let ([x, y], resolution) = (self.origin(), self.resolution);
        write!(
            writer,
            "image: \"{image}\"\nmode: trinary\nresolution: {resolution}\norigin: [{x}, {y}, 0.0]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )?;
        writer.flush()?;
        Ok(())
    }

    /// Writes `name.pgm` and `name.yaml` into a folder; each replaces an older file only when it is whole. The
    /// name may lead to a folder within, which exists: `floor1/map`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], naming the file.
    pub fn save(&self, folder: impl AsRef<Path>, name: &str) -> Result<(), Error> {
        let image_path = folder.as_ref().join(format!("{name}.pgm"));
        // Loaders look for the image from the description's own folder.
        let image = image_path.file_name().unwrap_or_default().to_string_lossy();
        let yaml_path = folder.as_ref().join(format!("{name}.yaml"));
        crate::files::save(&image_path, |writer| self.write_pgm(writer))?;
        crate::files::save(&yaml_path, |writer| self.write_yaml(writer, &image))
    }
}

fn gray(cell: CellState) -> u8 {
    match cell {
        CellState::Occupied => 0,
        CellState::Free => 254,
        CellState::Unknown => 205,
    }
}

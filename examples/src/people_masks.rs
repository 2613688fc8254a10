use std::path::Path;

use dymlm::core::Mask;

use crate::AnyError;

/// The exact masks of people in a frame of a recording: 8-bit PNGs in the folder `masks` beside the images,
/// with the names of the colour images; a pixel is 0 where nobody is, else the number of the person.
#[derive(Debug, Clone)]
pub struct PeopleMasks {
    width: usize,
    height: usize,
    people: Vec<u8>,
}

impl PeopleMasks {
    /// Masks without people.
    pub(crate) fn nobody(width: usize, height: usize) -> Self {
        Self { width, height, people: vec![0; width * height] }
    }

    pub(crate) fn read(path: &Path) -> Result<Self, AnyError> {
        let image = image::open(path).map_err(|error| format!("{}: {error}", path.display()))?.into_luma8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        Ok(Self { width, height, people: image.into_raw() })
    }

    /// The mask of all people, `true` where somebody is.
    ///
    /// # Errors
    ///
    /// When the image is empty.
    pub fn anybody(&self) -> Result<Mask, AnyError> {
        self.mask(|person| person > 0)
    }

    /// One mask for each person, `true` where that person is; some may be out of view.
    ///
    /// # Errors
    ///
    /// When the image is empty.
    pub fn each(&self) -> Result<Vec<Mask>, AnyError> {
        let last = self.people.iter().copied().max().unwrap_or(0);
        (1..=last).map(|person| self.mask(|other| other == person)).collect()
    }

    fn mask(&self, shows: impl Fn(u8) -> bool) -> Result<Mask, AnyError> {
        let data = self.people.iter().map(|&person| shows(person)).collect();
        Ok(Mask::new(self.width, self.height, data)?)
    }
}

use dymlm_core::{Error, Mask, PinholeCamera};

/// What is known of the movers in a frame, pixel by pixel.
///
/// The masks have the frame's size. A pixel that is in none of them, such as the rim around a silhouette or a
/// part that may be somebody's, is left out of the map and says nothing.
#[derive(Debug, Clone, Copy)]
pub struct MoverMasks<'a> {
    fixed: &'a Mask,
    movers: Option<&'a Mask>,
    unproven: Option<&'a Mask>,
}

impl<'a> MoverMasks<'a> {
    /// Only pixels that are `true` in `static_mask` are mapped.
    pub fn new(static_mask: &'a Mask) -> Self {
        Self { fixed: static_mask, movers: None, unproven: None }
    }

    /// Adds the pixels (`true`) that are surely a mover's: a place that is mostly read as a mover is no part
    /// of the static world, however long the mover stays and however often the detector misses it. Give it
    /// silhouettes; a whole box also holds the chair that somebody sits on.
    #[must_use]
    pub fn with_movers(mut self, mover_mask: &'a Mask) -> Self {
        self.movers = Some(mover_mask);
        self
    }

    /// Adds the pixels (`true`) of things that are new and may move: they are not mapped, but their readings
    /// speak for their place, so that things that stay are proven static in time.
    #[must_use]
    pub fn with_unproven(mut self, unproven_mask: &'a Mask) -> Self {
        self.unproven = Some(unproven_mask);
        self
    }

    pub(crate) fn static_mask(&self) -> &'a Mask {
        self.fixed
    }

    pub(crate) fn check(&self, camera: &PinholeCamera) -> Result<(), Error> {
        let mask = self.fixed;
        camera.check_size("the static mask", mask.width(), mask.height())?;
        for mask in self.movers.into_iter().chain(self.unproven) {
            camera.check_size("a mask of movers", mask.width(), mask.height())?;
        }
        Ok(())
    }

    /// The columns of row `v` that are surely a mover's.
    pub(crate) fn mover_columns(&self, v: usize) -> impl Iterator<Item = usize> {
        self.unmapped_columns(self.movers, v)
    }

    /// The columns of row `v` that show something new.
    pub(crate) fn unproven_columns(&self, v: usize) -> impl Iterator<Item = usize> {
        self.unmapped_columns(self.unproven, v)
    }

    fn unmapped_columns(&self, mask: Option<&'a Mask>, v: usize) -> impl Iterator<Item = usize> {
        let columns = mask.into_iter().flat_map(move |mask| mask.columns_of_row(v));
        columns.filter(move |&u| !self.fixed.at(u, v))
    }
}

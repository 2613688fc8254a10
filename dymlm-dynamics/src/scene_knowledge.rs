use dymlm_geometry::OrientedBox;

use crate::FreeSpace;

/// What is known of the scene besides a frame and its detections; nothing by default.
#[derive(Clone, Copy, Default)]
pub struct SceneKnowledge<'a> {
    carried: &'a [OrientedBox],
    free_space: Option<&'a dyn FreeSpace>,
}

impl<'a> SceneKnowledge<'a> {
    /// Adds moving bodies of known pose (world), such as a tracked object in somebody's hands: readings
    /// inside them are masked.
    #[must_use]
    pub fn with_carried(mut self, carried: &'a [OrientedBox]) -> Self {
        self.carried = carried;
        self
    }

    /// Adds a map of free space: readings in it are masked where a frame of the last half minute has looked
    /// through, whether a detector reports the mover or not.
    #[must_use]
    pub fn with_free_space(mut self, free_space: &'a dyn FreeSpace) -> Self {
        self.free_space = Some(free_space);
        self
    }

    pub(crate) fn carried(&self) -> &'a [OrientedBox] {
        self.carried
    }

    pub(crate) fn free_space(&self) -> Option<&'a dyn FreeSpace> {
        self.free_space
    }
}

impl std::fmt::Debug for SceneKnowledge<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SceneKnowledge")
            .field("carried", &self.carried)
            .field("free_space", &self.free_space.is_some())
            .finish()
    }
}

/// The views of one plane or landmark, prepared for the solver.
#[derive(Debug, Clone)]
pub(crate) struct Track<View> {
    /// Number of the plane or landmark among those that were added.
    pub(crate) number: usize,
    pub(crate) views: Vec<View>,
}

/// The planes, or the landmarks, of a graph.
#[derive(Debug, Clone)]
pub(crate) struct Tracks<View> {
    /// Those that more than one pose has seen.
    several: Vec<Track<View>>,
    /// Number of all that were added.
    added: usize,
}

impl<View> Default for Tracks<View> {
    fn default() -> Self {
        Self { several: Vec::new(), added: 0 }
    }
}

impl<View> Tracks<View> {
    /// Adds one by its views; `pose`: the pose of a view. What a single pose has seen says nothing.
    pub(crate) fn add(&mut self, views: Vec<View>, pose: impl Fn(&View) -> usize) {
        let number = self.added;
        self.added += 1;
        let mut poses = views.iter().map(pose);
        if poses.next().is_some_and(|first| poses.any(|pose| pose != first)) {
            drop(poses);
            self.several.push(Track { number, views });
        }
    }

    /// Those that more than one pose has seen.
    pub(crate) fn iter(&self) -> std::slice::Iter<'_, Track<View>> {
        self.several.iter()
    }

    pub(crate) fn len(&self) -> usize {
        self.several.len()
    }
}

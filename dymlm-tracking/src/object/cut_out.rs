use std::ops::Range;

use dymlm_core::{BoundingBox, PinholeCamera, Pose};

use super::model::ObjectModel;
use super::silhouette::silhouette;
use crate::GrayImage;

/// The part of an image around the object.
pub(super) struct CutOut {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
}

impl CutOut {
    /// The part of a box, widened by `rim` pixels, that lies on the image.
    pub(super) fn about(image: &GrayImage, region: BoundingBox, rim: f32) -> Option<Self> {
        let wider = BoundingBox::new(
            region.x_min() - rim,
            region.y_min() - rim,
            region.x_max() + rim,
            region.y_max() + rim,
        )
        .ok()?;
        Some(Self { columns: wider.columns(image.width()), rows: wider.rows(image.height()) })
    }

    pub(super) fn pixels(&self, image: &GrayImage) -> Option<GrayImage> {
        let row = |v: usize| image.clamped_row(v as isize).get(self.columns.clone()).unwrap_or(&[]);
        let data = self.rows.clone().flat_map(row).copied().collect();
        GrayImage::new(self.columns.len(), self.rows.len(), data).ok()
    }

    /// A mask of the pixels that show the object: inside the model's outline and accepted by `is_seen`.
    pub(super) fn mask(
        &self,
        model: &ObjectModel,
        camera: &PinholeCamera,
        camera_from_object: &Pose,
        is_seen: impl Fn(usize, usize) -> bool,
    ) -> Option<GrayImage> {
        let mut mask = silhouette(model, camera, camera_from_object, &self.columns, &self.rows)?;
        let pixels = self.rows.clone().flat_map(|v| self.columns.clone().map(move |u| (u, v)));
        for (value, (u, v)) in mask.data_mut().iter_mut().zip(pixels) {
            if *value > 0.0 && !is_seen(u, v) {
                *value = 0.0;
            }
        }
        Some(mask)
    }
}

#[cfg(feature = "serde")]
use crate::RunLengths;
use crate::{BoundingBox, Error, Mask};

/// One object found in an image by a 2D detector.
///
/// With the feature `serde` it is written like a line of `detections.jsonl`: `{"label", "score", "bbox":
/// [x_min, y_min, x_max, y_max], "mask"}`, the mask, if there is one, as COCO's run-lengths `{"size":
/// [height, width], "counts"}`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "PackedDetection"))]
pub struct Detection {
    label: String,
    score: f32,
    #[cfg_attr(feature = "serde", serde(rename = "bbox"))]
    bounding_box: BoundingBox,
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    mask: Option<Mask>,
}

impl Detection {
    /// Puts a detection together: a class label (COCO names with spaces, or the detector's own), the
    /// detector's confidence within 0..=1, and a box in pixels of the colour image.
    ///
    /// # Errors
    ///
    /// [`Error::Score`].
    ///
    /// ```
    /// use dymlm_core::{BoundingBox, Detection};
    ///
    /// let person = Detection::new("person", 0.91, BoundingBox::new(210.0, 8.0, 380.0, 480.0)?)?;
    /// assert_eq!(person.label(), "person");
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn new(label: impl Into<String>, score: f32, bounding_box: BoundingBox) -> Result<Self, Error> {
        if !(0.0..=1.0).contains(&score) {
            return Err(Error::Score(score));
        }
        Ok(Self { label: label.into(), score, bounding_box, mask: None })
    }

    /// Adds the detector's instance mask: `true` where a pixel belongs to the object; of the image's size.
    #[must_use]
    pub fn with_mask(mut self, mask: Mask) -> Self {
        self.mask = Some(mask);
        self
    }

    /// The detection in the image of every `stride`-th pixel of every `stride`-th row of this detection's
    /// image: see [`Frame::subsampled`](crate::Frame::subsampled).
    #[must_use]
    pub fn subsampled(&self, stride: usize) -> Self {
        let mask = self.mask.as_ref().map(|mask| {
            let mut smaller = mask.clone();
            smaller.subsample_from(mask, stride);
            smaller
        });
        Self { bounding_box: self.bounding_box.subsampled(stride), mask, label: self.label.clone(), ..*self }
    }

    /// Class label.
    #[inline]
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Confidence, 0..=1.
    #[inline]
    pub fn score(&self) -> f32 {
        self.score
    }

    /// The box, pixels.
    #[inline]
    pub fn bounding_box(&self) -> BoundingBox {
        self.bounding_box
    }

    /// The instance mask, if the detector gave one.
    #[inline]
    pub fn mask(&self) -> Option<&Mask> {
        self.mask.as_ref()
    }
}

/// A detection as it was read, its mask still in run-lengths: for those who keep the detections of many
/// frames.
#[cfg(feature = "serde")]
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(try_from = "RawDetection")]
pub struct PackedDetection {
    /// Without its mask.
    detection: Detection,
    mask: Option<RunLengths>,
}

#[cfg(feature = "serde")]
impl PackedDetection {
    /// The detection with its mask, if it has one. O(pixels / 64 + runs + columns).
    pub fn unpacked(&self) -> Detection {
        Detection { mask: self.mask.as_ref().map(RunLengths::mask), ..self.detection.clone() }
    }

    /// The instance mask, if the detector gave one.
    pub fn mask(&self) -> Option<&RunLengths> {
        self.mask.as_ref()
    }
}

#[cfg(feature = "serde")]
impl From<PackedDetection> for Detection {
    fn from(PackedDetection { detection, mask }: PackedDetection) -> Self {
        Self { mask: mask.map(|mask| mask.mask()), ..detection }
    }
}

#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawDetection {
    label: String,
    score: f32,
    bbox: BoundingBox,
    mask: Option<RunLengths>,
}

#[cfg(feature = "serde")]
impl TryFrom<RawDetection> for PackedDetection {
    type Error = Error;

    fn try_from(RawDetection { label, score, bbox, mask }: RawDetection) -> Result<Self, Error> {
        Ok(Self { detection: Detection::new(label, score, bbox)?, mask })
    }
}

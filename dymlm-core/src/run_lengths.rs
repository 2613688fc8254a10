use crate::pinhole_camera::check_image_size;
use crate::{Error, Mask};

/// Run-lengths as COCO has them (`pycocotools.mask`): numbers of pixels that are alike, down the columns from left to
/// right, the first of them `false`.
impl Mask {
    /// The mask as COCO's run-lengths. O(pixels).
    ///
    /// ```
    /// use dymlm_core::Mask;
    ///
    /// let mask = Mask::from_fn(3, 2, |u, v| u == 1 || (u, v) == (2, 0))?;
    /// assert_eq!(mask.run_lengths(), [2, 3, 1]);
    /// assert_eq!(Mask::from_run_lengths(3, 2, &[2, 3, 1])?, mask);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[doc(alias = "RLE")]
    pub fn run_lengths(&self) -> Vec<u32> {
        let mut runs = vec![0];
        let mut is_true = false;
        for (u, v) in (0..self.width()).flat_map(|u| (0..self.height()).map(move |v| (u, v))) {
            if self.at(u, v) != is_true {
                is_true = !is_true;
                runs.push(0);
            }
            runs.last_mut().into_iter().for_each(|run| *run += 1);
        }
        runs
    }

    /// The mask that COCO's run-lengths give.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`]; [`Error::RunLengths`] when they do not add up to the image.
    #[doc(alias = "RLE")]
    pub fn from_run_lengths(width: usize, height: usize, runs: &[u32]) -> Result<Self, Error> {
        let pixels = check_image_size(width, height)?;
        let sum = runs.iter().map(|&run| u64::from(run)).sum();
        if sum != pixels as u64 {
            return Err(Error::RunLengths { width, height, sum });
        }
        let mut mask = Self::filled(width, height, false)?;
        let mut start = 0;
        for (index, &run) in runs.iter().enumerate() {
            let end = start + run as usize;
            if index % 2 == 1 {
                (start..end).for_each(|pixel| mask.set(pixel / height, pixel % height, true));
            }
            start = end;
        }
        Ok(mask)
    }
}

/// COCO's object `{"size": [height, width], "counts": ...}`; counts are written as COCO's compressed text, and read as
/// that or as a list of numbers.
#[cfg(feature = "serde")]
mod coco {
    use std::borrow::Cow;

    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::Mask;

    #[derive(Serialize, Deserialize)]
    struct CocoMask<'a> {
        size: [usize; 2],
        #[serde(borrow)]
        counts: Counts<'a>,
    }

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Counts<'a> {
        List(Vec<u32>),
        #[serde(borrow)]
        Text(Cow<'a, str>),
    }

    impl Serialize for Mask {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let counts = Counts::Text(compressed(&self.run_lengths()).into());
            CocoMask { size: [self.height(), self.width()], counts }.serialize(serializer)
        }
    }

    impl<'de> Deserialize<'de> for Mask {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let CocoMask { size: [height, width], counts } = CocoMask::deserialize(deserializer)?;
            let runs = match counts {
                Counts::List(runs) => runs,
                Counts::Text(text) => decompressed(&text)
                    .ok_or_else(|| D::Error::custom("counts are no run-lengths of COCO"))?,
            };
            Self::from_run_lengths(width, height, &runs).map_err(D::Error::custom)
        }
    }

    /// `rleToString` of the COCO API: from the fourth run on the difference to the run before the last, in groups of five
    /// bits from the lowest, each a character from 48 on with bit 5 set when another follows.
    fn compressed(runs: &[u32]) -> String {
        let mut text = String::new();
        for (index, &run) in runs.iter().enumerate() {
            let before =
                index.checked_sub(2).filter(|&before| before > 0).and_then(|before| runs.get(before));
            let mut rest = i64::from(run) - before.map_or(0, |&before| i64::from(before));
            loop {
                let group = (rest & 0x1f) as u8;
                rest >>= 5;
                let is_last = if group & 0x10 == 0 { rest == 0 } else { rest == -1 };
                text.push(char::from(48 + (group | if is_last { 0 } else { 0x20 })));
                if is_last {
                    break;
                }
            }
        }
        text
    }

    /// `rleFrString` of the COCO API; `None` for what it never writes.
    fn decompressed(text: &str) -> Option<Vec<u32>> {
        let mut runs: Vec<u32> = Vec::new();
        let (mut value, mut shift) = (0_i64, 0);
        for byte in text.bytes() {
            let group = byte.checked_sub(48).filter(|&group| group < 64 && shift < 40)?;
            value |= i64::from(group & 0x1f) << shift;
            shift += 5;
            if group & 0x20 == 0 {
                if group & 0x10 != 0 {
                    value |= -1 << shift;
                }
                let before = runs.len().checked_sub(2).filter(|&before| before > 0);
                let before = before.and_then(|before| runs.get(before));
                runs.push(u32::try_from(value + before.map_or(0, |&before| i64::from(before))).ok()?);
                (value, shift) = (0, 0);
            }
        }
        (shift == 0).then_some(runs)
    }

    #[cfg(test)]
    mod tests {
        use crate::Mask;

        /// `encode(...)["counts"]` of pycocotools 2.0.
        #[test]
        fn masks_are_written_as_pycocotools_does() {
            let of = |mask: &Mask| {
                let json = serde_json::to_value(mask).unwrap();
                assert_eq!(serde_json::from_value::<Mask>(json.clone()).unwrap(), *mask);
                json["counts"].as_str().unwrap().to_owned()
            };
            let small = Mask::from_fn(7, 5, |u, v| (u * u + 3 * v) % 5 < 2).unwrap();
            assert_eq!(of(&small), "0110100010N010O11OO0001000O");
            let ellipse = Mask::from_fn(64, 48, |u, v| {
                ((u as f64 - 30.0) / 20.0).powi(2) + ((v as f64 - 22.0) / 15.0).powi(2) < 1.0
            });
            let expected =
                "Ra09U14M2N2N2N2N2O0O2O0O2O0O2O0000000000000000000000000001N101N101N101N2N2N2N2N3L`d0";
            assert_eq!(of(&ellipse.unwrap()), expected);
            assert_eq!(of(&Mask::filled(640, 480, true).unwrap()), "0PP\\9");
        }

        #[test]
        fn uncompressed_counts_are_read_too() {
            let mask: Mask = serde_json::from_str(r#"{"size": [2, 3], "counts": [2, 3, 1]}"#).unwrap();
            assert_eq!(mask, Mask::from_fn(3, 2, |u, v| u == 1 || (u, v) == (2, 0)).unwrap());
        }

        #[test]
        fn runs_that_are_no_mask_are_refused() {
            for counts in
                ["[1, 2]", "[7]", "[4294967295]", r#""\u0001""#, r#""P""#, r#""~~~~~~~~~~~~~""#, r#""O""#]
            {
                let json = format!(r#"{{"size": [2, 3], "counts": {counts}}}"#);
                assert!(serde_json::from_str::<Mask>(&json).is_err(), "{counts}");
            }
            assert!(serde_json::from_str::<Mask>(r#"{"size": [0, 3], "counts": []}"#).is_err());
            let error = serde_json::from_str::<Mask>(r#"{"size": [2, 3], "counts": [1, 2]}"#).unwrap_err();
            assert!(error.to_string().contains("add up to 3, an image of 3x2 pixels has 6"), "{error}");
        }
    }
}

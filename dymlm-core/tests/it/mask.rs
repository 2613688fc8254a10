//! Masks: bits, a network's letterbox, COCO's run-lengths.
mod bits {
    use dymlm_core::Mask;

    /// Sizes below, at and above whole words.
    const WIDTHS: [usize; 6] = [1, 63, 64, 65, 128, 130];

    fn speckled(width: usize) -> Mask {
        Mask::from_fn(width, 3, |u, v| (u * 7 + v * 3) % 5 < 2).unwrap()
    }

    #[test]
    fn every_pixel_has_its_own_bit() {
        for width in WIDTHS {
            let pixels: Vec<bool> = (0..width * 3).map(|i| (i % width * 7 + i / width * 3) % 5 < 2).collect();
            let mask = Mask::new(width, 3, pixels.clone()).unwrap();
            assert_eq!(mask, speckled(width));
            assert!(mask.pixels().eq(pixels.iter().copied()));
            assert_eq!(mask.count(), pixels.iter().filter(|&&p| p).count());
            let mut copy = Mask::filled(width, 3, false).unwrap();
            for v in 0..3 {
                mask.columns_of_row(v).for_each(|u| copy.set(u, v, true));
            }
            assert_eq!(copy, mask);
            let mut copy = Mask::filled(width, 3, true).unwrap();
            for (i, &pixel) in pixels.iter().enumerate() {
                assert_eq!(mask.at(i % width, i / width), pixel);
                copy.set(i % width, i / width, pixel);
            }
            assert_eq!(copy, mask);
        }
    }

    #[test]
    fn outside_the_image_nothing_belongs_and_nothing_is_set() {
        for width in WIDTHS {
            let mut mask = Mask::filled(width, 2, true).unwrap();
            assert!(!mask.at(0, usize::MAX) && !mask.at(usize::MAX, 0));
            assert!(!mask.at(width, 0) && !mask.at(0, 2) && !mask.at(width.next_multiple_of(64), 0));
            mask.set(width, 0, false);
            mask.set(0, 2, false);
            mask.set(0, usize::MAX, false);
            mask.fill_row(2, 0..width, false);
            mask.fill_row(0, width..width + 9, false);
            assert_eq!(mask.count(), 2 * width);
            assert_eq!(mask, mask.inverted().inverted());
            assert_eq!(mask.inverted().count(), 0);
            assert_eq!(mask.row(2).count() + mask.columns_of_row(2).count() + mask.row_words(2).len(), 0);
        }
    }

    #[test]
    fn stretches_of_a_row_are_filled_to_the_pixel() {
        for width in WIDTHS {
            for (start, end) in
                [(0, width), (1, width), (width / 2, width / 2 + 1), (3, 70), (64, 65), (5, 5)]
            {
                let mut mask = speckled(width);
                for value in [true, false] {
                    mask.fill_row(1, start..end, value);
                    let before = speckled(width);
                    let is_filled = |u: usize, v: usize| v == 1 && (start..end).contains(&u);
                    let expected = |u, v| if is_filled(u, v) { value } else { before.at(u, v) };
                    assert_eq!(mask, Mask::from_fn(width, 3, expected).unwrap());
                }
            }
        }
    }

    #[test]
    fn a_row_keeps_its_values_inside_the_mask_alone() {
        for width in WIDTHS {
            let mask = speckled(width);
            let mut row = vec![7; width];
            mask.overwrite_outside(1, &mut row, 0);
            assert!(row.iter().zip(mask.row(1)).all(|(&value, kept)| value == if kept { 7 } else { 0 }));
        }
    }

    #[test]
    fn sets_are_united_and_subtracted() {
        let mut mask = speckled(70);
        let before = mask.count();
        let rest = mask.inverted();
        mask.unite(&rest).unwrap();
        assert_eq!(mask, Mask::filled(70, 3, true).unwrap());
        mask.subtract(&rest).unwrap();
        assert_eq!((mask.count(), &mask), (before, &speckled(70)));
        let error = mask.unite(&speckled(71)).unwrap_err();
        assert_eq!(error.to_string(), "a mask of 71x3 pixels combined with one of 70x3");
    }

    #[test]
    fn every_other_pixel_of_a_mask_keeps_its_value() {
        for width in WIDTHS {
            let mask = speckled(width);
            let mut third = Mask::filled(5, 5, true).unwrap();
            third.subsample_from(&mask, 3);
            let expected = Mask::from_fn(width.div_ceil(3), 1, |u, v| mask.at(u * 3, v * 3)).unwrap();
            assert_eq!(third, expected);
        }
    }

    #[test]
    fn a_mask_is_refilled_with_another_size() {
        let mut mask = speckled(65);
        mask.refill(70, 2, true).unwrap();
        assert_eq!(mask, Mask::filled(70, 2, true).unwrap());
        assert!(mask.refill(0, 2, true).is_err());
        assert_eq!(mask.count(), 140);
    }
}

mod letterbox {
    use dymlm_core::{BoundingBox, Letterbox, Mask};

    /// Waves, smooth as a network's logits.
    fn logits() -> Vec<f32> {
        let score = |u: f64, v: f64| (u * 0.21 + 0.3).sin() + (v * 0.17 - 0.2).cos() - 0.2;
        (0..160 * 160).map(|i| score(f64::from(i % 160), f64::from(i / 160)) as f32).collect()
    }

    /// Counts of `cv2.resize(logits[bars cut off], (width, height), INTER_LINEAR) > 0` of `OpenCV` 5.0.0;
    /// some ten pixels lie within its rounding of 0.
    #[test]
    fn masks_are_those_of_opencv() {
        for (image, expected) in [([640, 480], 124_176), ([480, 640], 129_617), ([1280, 720], 426_638)] {
            let letterbox = Letterbox::centered(image, [160, 160]).unwrap();
            let mask = Mask::from_letterbox(&letterbox, &logits(), 0.0, None).unwrap();
            assert!(mask.count().abs_diff(expected) <= 10, "{} instead of {expected}", mask.count());
            if image == [640, 480] {
                let rows = [0, 100, 239, 479].map(|v| mask.columns_of_row(v).count());
                assert_eq!(rows, [0, 389, 450, 274]);
                let area = BoundingBox::new(100.0, 50.0, 300.0, 400.0).unwrap();
                let cut = Mask::from_letterbox(&letterbox, &logits(), 0.0, Some(&area)).unwrap();
                assert!(cut.count().abs_diff(36_481) <= 1);
            }
        }
    }

    #[test]
    fn scores_of_another_count_are_refused() {
        let letterbox = Letterbox::centered([64, 48], [16, 16]).unwrap();
        assert!(Mask::from_letterbox(&letterbox, &[0.0; 255], 0.0, None).is_err());
        assert!(Letterbox::centered([64, 0], [16, 16]).is_err());
    }

    #[test]
    fn a_line_of_pixels_still_has_a_mask() {
        let letterbox = Letterbox::centered([1000, 1], [16, 16]).unwrap();
        assert_eq!(Mask::from_letterbox(&letterbox, &[1.0; 256], 0.0, None).unwrap().count(), 1000);
    }
}

mod any_runs {
    use dymlm_core::{Mask, RunLengths};
    use proptest::prelude::*;

    proptest! {
        /// Runs of single pixels, of parts of columns and of many columns, in images of any size.
        #[test]
        fn run_lengths_and_back_are_the_mask(
            width in 1..200_usize,
            height in 1..200_usize,
            runs in prop::collection::vec(prop_oneof![0..3_usize, 0..100_usize, 0..5000_usize], 1..60),
        ) {
            let is_true: Vec<bool> = runs
                .iter()
                .enumerate()
                .flat_map(|(index, &run)| std::iter::repeat_n(index % 2 == 1, run))
                .cycle()
                .take(if runs.iter().all(|&run| run == 0) { 0 } else { width * height })
                .collect();
            let belongs = |u: usize, v: usize| is_true.get(u * height + v).is_some_and(|&is_true| is_true);
            let mask = Mask::from_fn(width, height, belongs).unwrap();
            let runs = mask.run_lengths();
            prop_assert_eq!(&Mask::from_run_lengths(width, height, &runs).unwrap(), &mask);
            prop_assert_eq!(RunLengths::new(width, height, runs).unwrap().mask(), mask);
        }
    }
}

#[cfg(feature = "serde")]
mod run_lengths {
    use dymlm_core::Mask;

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
        let expected = "Ra09U14M2N2N2N2N2O0O2O0O2O0O2O0000000000000000000000000001N101N101N101N2N2N2N2N3L`d0";
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

    #[test]
    fn words_make_the_mask_that_they_are_of() {
        for width in [1, 63, 64, 65, 130] {
            let mask = Mask::from_fn(width, 3, |u, v| (u * 7 + v) % 3 == 0).unwrap();
            let mut words: Vec<u64> = (0..3).flat_map(|v| mask.row_words(v).to_vec()).collect();
            assert_eq!(Mask::from_words(width, 3, words.clone()).unwrap(), mask);
            if width % 64 > 0 {
                *words.last_mut().unwrap() |= 1 << 63;
                assert_eq!(Mask::from_words(width, 3, words.clone()).unwrap(), mask);
            }
            words.pop();
            assert!(Mask::from_words(width, 3, words).is_err());
        }
    }
}

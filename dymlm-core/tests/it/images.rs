//! Images, frames and detections.
mod depth_image {
    use dymlm_core::{DepthImage, Error};

    #[test]
    fn refuses_a_buffer_of_another_length() {
        assert_eq!(
            DepthImage::new(3, 2, vec![0.0; 5]),
            Err(Error::BufferLength { width: 3, height: 2, expected: 6, actual: 5 })
        );
        assert!(DepthImage::new(0, 0, Vec::new()).is_err());
    }

    #[test]
    fn scales_integers() {
        let depth = DepthImage::from_u16(2, 1, &[0, 10_000], 5000.0).unwrap();
        assert_eq!(depth.data(), [0.0, 2.0]);
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(DepthImage::from_u16(2, 1, &[0, 1], scale).is_err());
        }
    }

    #[test]
    fn a_refused_buffer_leaves_the_readings_as_they_were() {
        let mut depth = DepthImage::new(2, 2, vec![1.0; 4]).unwrap();
        let before = depth.clone();
        assert_eq!(
            depth.refill_from_u16(&[7; 4], 3, 1000.0),
            Err(Error::RowStride { size: [2, 2], row_stride: 3, expected: 5, actual: 4 })
        );
        assert!(depth.refill_from_u16(&[7; 4], 1, 1000.0).is_err(), "rows overlap");
        assert!(depth.refill_from_u16(&[7; 4], 2, 0.0).is_err());
        assert_eq!(depth, before);
        // The last row needs no filling behind it.
        depth.refill_from_metres(&[1.0, f32::NAN, 9.0, -1.0, 4.0], 3).unwrap();
        assert_eq!(depth.data(), [1.0, 0.0, 0.0, 4.0]);
    }

    #[test]
    fn outside_there_is_no_reading() {
        let depth = DepthImage::new(2, 2, vec![1.0; 4]).unwrap();
        assert_eq!([depth.at(1, 1), depth.at(2, 0), depth.at(0, 2)], [1.0, 0.0, 0.0]);
        assert_eq!([depth.at(0, usize::MAX), depth.at(usize::MAX, 0)], [0.0; 2]);
        assert_eq!(depth.row(1).len(), 2);
        assert!(depth.row(2).is_empty());
    }
}

mod color_image {
    use dymlm_core::{ColorImage, Error, PixelFormat};

    #[test]
    fn all_orders_of_channels_give_the_same_image() {
        let expected = ColorImage::new(2, 1, vec![[1, 2, 3], [4, 5, 6]]).unwrap();
        for (format, bytes) in [
            (PixelFormat::Rgb8, vec![1, 2, 3, 4, 5, 6]),
            (PixelFormat::Bgr8, vec![3, 2, 1, 6, 5, 4]),
            (PixelFormat::Rgba8, vec![1, 2, 3, 9, 4, 5, 6, 9]),
            (PixelFormat::Bgra8, vec![3, 2, 1, 9, 6, 5, 4, 9]),
        ] {
            let image = ColorImage::from_bytes(2, 1, &bytes, format, bytes.len()).unwrap();
            assert_eq!(image, expected, "{format:?}");
        }
    }

    #[test]
    fn a_short_buffer_is_refused_with_the_length_it_needs() {
        let error = ColorImage::from_bytes(2, 2, &[0; 13], PixelFormat::Rgb8, 8).unwrap_err();
        assert_eq!(error, Error::RowStride { size: [6, 2], row_stride: 8, expected: 14, actual: 13 });
        assert!(ColorImage::from_bytes(2, 2, &[0; 12], PixelFormat::Rgb8, 5).is_err(), "rows overlap");
        assert!(ColorImage::from_bytes(0, 2, &[], PixelFormat::Rgb8, 0).is_err());
        assert!(ColorImage::from_bytes(1, usize::MAX, &[], PixelFormat::Rgb8, usize::MAX).is_err());
    }
}

mod frame {
    use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera};

    #[test]
    fn a_subsampled_frame_sees_the_same_points() {
        let camera = PinholeCamera::new(7, 5, 4.0, 5.0, 3.1, 2.3).unwrap();
        let depth = DepthImage::new(7, 5, (1..36).map(|i| i as f32 * 0.1).collect()).unwrap();
        let color = ColorImage::new(7, 5, (0..35).map(|i| [i; 3]).collect()).unwrap();
        let frame = Frame::new(3.0, camera, depth, Some(color)).unwrap();
        assert_eq!(frame.subsampled(1).unwrap(), frame);
        for stride in [2, 3, 7, 9] {
            let smaller = frame.subsampled(stride).unwrap();
            let [width, height] = [7_usize, 5].map(|size| size.div_ceil(stride));
            assert_eq!((smaller.depth().width(), smaller.depth().height()), (width, height));
            for (u, v) in (0..height).flat_map(|v| (0..width).map(move |u| (u, v))) {
                let (whole_u, whole_v) = (u * stride, v * stride);
                let z = frame.depth().at(whole_u, whole_v);
                assert_eq!(smaller.depth().at(u, v), z);
                assert_eq!(smaller.color().unwrap().at(u, v), frame.color().unwrap().at(whole_u, whole_v));
                let point = smaller.camera().back_project([u as f64, v as f64], z.into());
                let same = camera.back_project([whole_u as f64, whole_v as f64], z.into());
                assert!(point.iter().zip(same).all(|(a, b)| (a - b).abs() < 1e-12));
            }
            let mut spare = frame.clone();
            frame.subsample_into(stride, &mut spare).unwrap();
            assert_eq!(spare, smaller);
        }
    }

    #[test]
    fn refuses_images_of_another_size() {
        let camera = PinholeCamera::new(2, 2, 1.0, 1.0, 0.5, 0.5).unwrap();
        let depth = DepthImage::new(2, 2, vec![1.0; 4]).unwrap();
        let color = ColorImage::new(1, 2, vec![[0; 3]; 2]).unwrap();
        let error = Frame::new(0.0, camera, depth.clone(), Some(color)).unwrap_err();
        assert_eq!(error.to_string(), "the colour image has 1x2 pixels, the camera 2x2");
        assert!(Frame::new(f64::NAN, camera, depth, None).is_err());
    }
}

mod detection {
    use dymlm_core::{BoundingBox, Detection, Error, Mask};

    #[test]
    fn a_subsampled_detection_has_the_box_and_the_mask_of_the_smaller_image() {
        let mask = Mask::from_fn(9, 6, |u, v| (3..8).contains(&u) && v > 1).unwrap();
        let cup = Detection::new("cup", 0.5, BoundingBox::new(3.0, 2.0, 8.0, 6.0).unwrap()).unwrap();
        let half = cup.with_mask(mask).subsampled(2);
        assert_eq!((half.label(), half.score()), ("cup", 0.5));
        assert_eq!((half.bounding_box().columns(5), half.bounding_box().rows(3)), (2..4, 1..3));
        assert_eq!(half.mask(), Some(&Mask::from_fn(5, 3, |u, v| (2..4).contains(&u) && v > 0).unwrap()));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_line_of_a_file_gives_the_detection_back() {
        let person = Detection::new("person", 0.75, BoundingBox::new(1.0, 0.0, 3.0, 2.0).unwrap()).unwrap();
        let without = r#"{"label":"person","score":0.75,"bbox":[1.0,0.0,3.0,2.0]}"#;
        assert_eq!(serde_json::to_string(&person).unwrap(), without);
        assert_eq!(serde_json::from_str::<Detection>(without).unwrap(), person);
        let person = person.with_mask(Mask::from_fn(4, 2, |u, _| u > 0).unwrap());
        let written = serde_json::to_string(&person).unwrap();
        assert!(written.ends_with(r#""mask":{"size":[2,4],"counts":"26"}}"#), "{written}");
        assert_eq!(serde_json::from_str::<Detection>(&written).unwrap(), person);
        for refused in [without.replace("0.75", "1.5"), without.replace("3.0", "0.5")] {
            assert!(serde_json::from_str::<Detection>(&refused).is_err());
        }
    }

    #[test]
    fn refuses_scores_that_are_no_confidence() {
        let bounding_box = BoundingBox::new(0.0, 0.0, 1.0, 1.0).unwrap();
        for score in [-0.1, 1.1, f32::NAN] {
            assert!(matches!(Detection::new("cup", score, bounding_box), Err(Error::Score(_))));
        }
    }
}

mod organized_cloud {
    use dymlm_core::{DepthImage, OrganizedCloud, PinholeCamera};

    #[test]
    fn agrees_with_the_camera_pixel_by_pixel() {
        let camera = PinholeCamera::new(64, 48, 52.6, 51.9, 31.2, 24.1).unwrap();
        let data = (0..64 * 48).map(|i| if i % 7 == 0 { 0.0 } else { 0.5 + i as f32 * 1e-3 }).collect();
        let depth = DepthImage::new(64, 48, data).unwrap();
        let mut cloud = OrganizedCloud::new();
        cloud.back_project(&camera, &depth).unwrap();
        for v in 0..48 {
            for u in 0..64 {
                let expected = camera.back_project([u as f64, v as f64], f64::from(depth.at(u, v)));
                for (axis, value) in cloud.points()[v * 64 + u].into_iter().enumerate() {
                    assert!((f64::from(value) - expected[axis]).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn a_refused_frame_changes_nothing() {
        let camera = PinholeCamera::new(2, 2, 1.0, 1.0, 0.0, 0.0).unwrap();
        let mut cloud = OrganizedCloud::new();
        cloud.back_project(&camera, &DepthImage::new(2, 2, vec![1.0; 4]).unwrap()).unwrap();
        let before = cloud.clone();
        assert!(cloud.back_project(&camera, &DepthImage::new(1, 2, vec![1.0; 2]).unwrap()).is_err());
        assert_eq!(cloud, before);
    }
}

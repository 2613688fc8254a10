//! Grey images and pyramids of them.

use dymlm_core::ColorImage;
use dymlm_tracking::{Error, GrayImage, ImagePyramid};

#[test]
fn refuses_a_buffer_of_another_length_and_absurd_sizes() {
    assert_eq!(
        GrayImage::new(3, 2, vec![0.0; 5]),
        Err(Error::Core(dymlm_core::Error::BufferLength { width: 3, height: 2, expected: 6, actual: 5 }))
    );
    assert!(GrayImage::new(0, 0, Vec::new()).is_err());
    assert!(GrayImage::new(usize::MAX, 3, Vec::new()).is_err());
}

#[test]
fn nan_becomes_black() {
    let image = GrayImage::new(2, 1, vec![f32::NAN, 0.5]).unwrap();
    assert_eq!(image.data(), [0.0, 0.5]);
}

#[test]
fn a_buffer_is_used_again_for_another_size() {
    let mut image = GrayImage::new(3, 2, vec![0.25; 6]).unwrap();
    image.assign_color(&ColorImage::new(1, 2, vec![[0; 3], [255; 3]]).unwrap());
    assert_eq!((image.width(), image.height(), image.at(0, 0)), (1, 2, 0.0));
    assert!((image.at(0, 1) - 1.0).abs() < 1e-6);
}

#[test]
fn a_ramp_stays_a_ramp() {
    for width in [32, 33] {
        let data = (0..width * 20).map(|i| (i % width) as f32 + 3.0 * (i / width) as f32).collect();
        let pyramid = ImagePyramid::new(&GrayImage::new(width, 20, data).unwrap(), 2);
        let half = &pyramid.levels()[1];
        for v in 1..9 {
            for u in 1..half.width() - 2 {
                assert!((half.at(u, v) - (2 * u) as f32 - 6.0 * v as f32).abs() < 1e-3);
            }
        }
    }
}

#[test]
fn tiny_images_and_deep_pyramids_do_no_harm() {
    for (width, height) in [(1, 1), (1, 7), (2, 1), (3, 2)] {
        let pyramid =
            ImagePyramid::new(&GrayImage::new(width, height, vec![0.5; width * height]).unwrap(), 99);
        assert_eq!(pyramid.levels().len(), 16);
        for level in pyramid.levels() {
            assert!(level.width() > 0 && level.data().iter().all(|value| (value - 0.5).abs() < 1e-6));
        }
    }
}

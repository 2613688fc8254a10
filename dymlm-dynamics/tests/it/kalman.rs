//! The box filter against a filter of seven states.
use dymlm_core::BoundingBox;
use dymlm_dynamics::BoxKalman;

fn boxed([x_min, y_min, x_max, y_max]: [f32; 4]) -> BoundingBox {
    BoundingBox::new(x_min, y_min, x_max, y_max).unwrap()
}

/// Figures of filterpy 2.0.0, `KalmanFilter(dim_x=7, dim_z=4)` set up as in the published `sort.py`: x and
/// the diagonal of P after each frame, with a detection in all frames but the third.
#[test]
#[allow(clippy::unreadable_literal, clippy::excessive_precision, reason = "figures of another program")]
fn is_the_filter_of_seven_states() {
    let frames = [
        (
            Some([12.0, 21.0, 53.0, 103.0]),
            [
                32.49975029964043,
                61.99980023971234,
                3361.838339487077,
                0.5,
                2.497003595685178,
                1.9976028765481422,
                161.66051292286198,
            ],
            [
                0.9999001198561726,
                0.9999001198561726,
                9.990020955992415,
                5.238095238095238,
                11.995617259289915,
                11.995617259289915,
                20.956092415926015,
            ],
        ),
        (
            Some([15.0, 21.0, 57.0, 105.0]),
            [
                35.9409616309672,
                63.05869452468132,
                3527.272884959469,
                0.5,
                3.2641728821186495,
                1.2349016475845649,
                163.9098532203032,
            ],
            [
                0.9411526556069119,
                0.9411526556069119,
                8.384600757956626,
                3.841642228739003,
                2.068953789200077,
                2.068953789200077,
                5.497101690287312,
            ],
        ),
        (
            None,
            [
                39.20513451308585,
                64.2935961722659,
                3691.1827381797725,
                0.5,
                3.2641728821186495,
                1.2349016475845649,
                163.9098532203032,
            ],
            [
                5.539480509374052,
                5.539480509374052,
                24.87622163445325,
                4.841642228739003,
                2.0789537892000767,
                2.0789537892000767,
                5.497201690287312,
            ],
        ),
        (
            Some([20.0, 24.0, 63.0, 108.0]),
            [
                41.563412626461954,
                65.96915406632226,
                3650.9807932239733,
                0.5043899084994975,
                2.9526523551123547,
                1.386435215131332,
                101.5734722597896,
            ],
            [
                0.9345794463390267,
                0.9345794463390267,
                8.39646313367817,
                3.6875231395779338,
                0.5101212437560283,
                0.5101212437560283,
                1.3965754775303227,
            ],
        ),
    ];
    let mut filter = BoxKalman::new(&boxed([10.0, 20.0, 50.0, 100.0]));
    for (measured, state, variances) in frames {
        filter.predict(1.0 / 30.0);
        if let Some(measured) = measured {
            filter.update(&boxed(measured));
        }
        let expected = state.into_iter().chain(variances);
        for (found, expected) in filter.state().into_iter().chain(filter.variances()).zip(expected) {
            assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found} instead of {expected}");
        }
    }
}

#[test]
fn time_passes_alike_in_one_step_or_in_many() {
    let mut filter = BoxKalman::new(&boxed([10.0, 20.0, 50.0, 100.0]));
    filter.predict(0.1);
    filter.update(&boxed([16.0, 20.0, 56.0, 100.0]));
    let mut once = filter.clone();
    once.predict(0.4);
    for _ in 0..4 {
        filter.predict(0.1);
    }
    for (once, often) in once.state().into_iter().zip(filter.state()) {
        assert!((once - often).abs() < 1e-9 * once.abs().max(1.0));
    }
    // 6 pixels in 0.1 s; after 0.4 s more it is 24 pixels on, but for the start's pull.
    assert!((filter.center()[0] - 60.0).abs() < 0.1);
}

#[test]
fn a_shrinking_box_does_not_vanish() {
    let mut filter = BoxKalman::new(&boxed([0.0, 0.0, 100.0, 100.0]));
    for side in [60.0, 20.0, 4.0] {
        filter.predict(1.0 / 30.0);
        filter.update(&boxed([0.0, 0.0, side, side]));
    }
    for _ in 0..100 {
        filter.predict(1.0 / 30.0);
        assert!(filter.bounding_box().unwrap().area() > 0.0);
    }
}

#[test]
fn absurd_boxes_do_not_poison_it() {
    for sides in [[0.0; 4], [-1e38, -1e38, 1e38, 1e38], [1e30, 0.0, 1e30, 1e-30]] {
        let mut filter = BoxKalman::new(&boxed(sides));
        for _ in 0..3 {
            filter.predict(0.1);
            filter.update(&boxed(sides));
        }
        assert!(filter.state().iter().chain(&filter.variances()).all(|value| value.is_finite()));
    }
}

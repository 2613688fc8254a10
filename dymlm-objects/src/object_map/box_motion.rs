use dymlm_core::BoundingBox;

/// The last two boxes of an object in the image, from which the next one is predicted at constant velocity.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct BoxMotion {
    last: Option<TimedBox>,
    before: Option<TimedBox>,
}

#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct TimedBox {
    time: f64,
    bounding_box: BoundingBox,
}

impl BoxMotion {
    /// Whether its times are finite; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.last.iter().chain(&self.before).all(|timed| timed.time.is_finite())
    }

    pub(crate) fn observe(&mut self, time: f64, bounding_box: BoundingBox) {
        self.before = self.last;
        self.last = Some(TimedBox { time, bounding_box });
    }

    /// The box at `time`; `None` when the last one is older than `max_gap` seconds.
    pub(crate) fn predict(&self, time: f64, max_gap: f64) -> Option<BoundingBox> {
        let last = self.last.filter(|last| time - last.time <= max_gap)?;
        let Some(before) =
            self.before.filter(|before| last.time > before.time && last.time - before.time <= max_gap)
        else {
            return Some(last.bounding_box);
        };
        let share = ((time - last.time) / (last.time - before.time)) as f32;
        let (from, to) = (<[f32; 4]>::from(before.bounding_box), <[f32; 4]>::from(last.bounding_box));
        let sides: [f32; 4] = std::array::from_fn(|side| to[side] + share * (to[side] - from[side]));
        Some(BoundingBox::try_from(sides).unwrap_or(last.bounding_box))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32) -> BoundingBox {
        BoundingBox::new(x, 0.0, x + 10.0, 10.0).unwrap()
    }

    #[test]
    fn motion_goes_on_until_it_is_too_old() {
        let mut motion = BoxMotion::default();
        assert_eq!(motion.predict(0.0, 0.5), None);
        motion.observe(0.0, at(0.0));
        assert_eq!(motion.predict(0.25, 0.5), Some(at(0.0)));
        motion.observe(0.25, at(4.0));
        assert_eq!(motion.predict(0.5, 0.5), Some(at(8.0)));
        assert_eq!(motion.predict(0.8, 0.5), None);
        // After a gap the velocity is unknown.
        motion.observe(5.0, at(40.0));
        assert_eq!(motion.predict(5.1, 0.5), Some(at(40.0)));
    }
}

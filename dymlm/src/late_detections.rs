use std::sync::Arc;

use dymlm_core::{Detection, FrameId, Pose};
use dymlm_dynamics::Preprocessor;
use dymlm_history::Observation;
use dymlm_planes::PlaneDetector;

use crate::session_log::{Event, KeyFrameEntry, SeenThings};
use crate::subsampler::{in_all_pixels, masked_in_all_pixels};
use crate::{CorrectionReport, Error, FrameOutcome, FrameReport, MapBuilder};

/// Detections of a key frame that was mapped without any, because they came too late.
impl MapBuilder {
    /// Takes the movers among the detections out of the maps, and brings the things in.
    ///
    /// Movers are looked for in this frame alone: what tracking had masked in it stays masked.
    pub(crate) fn mend(&mut self, frame: FrameId, found: &[Detection]) -> Result<FrameReport, Error> {
        let log = self.map.past.log.as_ref().ok_or(Error::NotPending { frame })?;
        let (place, entry) = log.key_frame(frame).ok_or(Error::NotPending { frame })?;
        let before = log.history.get(entry.observation)?;
        if before.detections.is_some() {
            return Err(Error::NotPending { frame });
        }
        let poses: Vec<Pose> = log.poses().collect();
        let pose = &poses[frame.get() as usize];
        // On the caller's clock; the observation has the maps'.
        let timestamp = log.frame(frame).ok_or(Error::UnknownFrame { frame })?.timestamp;

        let stride = self.config.sensor.stride;
        let found: Vec<Detection> = found.iter().map(|detection| detection.subsampled(stride)).collect();
        let mut preprocessor = Preprocessor::new(self.config.dynamics.clone(), self.config.sensor)?;
        Preprocessor::check(&before.frame, &found)?;
        preprocessor.process(&before.frame, Some(&found), pose)?;
        let mended = self.mended(&before, &preprocessor, found)?;

        let mut report = FrameReport::waiting(frame, timestamp);
        report.movers = in_all_pixels(preprocessor.movers(), stride);
        report.masked_pixels = masked_in_all_pixels(&mended.static_mask, stride);
        let correction = self.replace(place, entry, mended, &poses)?;
        report.outcome = FrameOutcome::Mended(Box::new(correction));
        Ok(report)
    }

    /// The observation without the movers that were found now, and with planes that were detected without
    /// them.
    fn mended(
        &self,
        before: &Observation,
        preprocessor: &Preprocessor,
        found: Vec<Detection>,
    ) -> Result<Observation, Error> {
        let mut mended = before.clone();
        mended.static_mask.subtract(&preprocessor.static_mask().inverted())?;
        // What was sure before was a prediction, which the detector now confirms or does not.
        mended.mover_mask.clone_from(preprocessor.mover_mask());
        mended.unproven_mask.subtract(preprocessor.mover_mask())?;
        let boxes: Vec<_> = preprocessor.movers().iter().map(|mover| mover.corrected_box).collect();
        let mut detector = PlaneDetector::new(&self.config.planes.detector, &self.config.sensor)?;
        mended.planes = detector.detect(&mended.frame, Some(&mended.static_mask), &boxes)?.to_vec();
        mended.detections = Some(found);
        Ok(mended)
    }

    /// Replaces the observation of a key frame, and maps it again.
    fn replace(
        &mut self,
        place: usize,
        before: KeyFrameEntry,
        mended: Observation,
        poses: &[Pose],
    ) -> Result<CorrectionReport, Error> {
        let log = self.map.past.log.as_mut().ok_or(Error::NoHistory)?;
        let observation = log.history.push(Arc::new(mended));
        // Its planes are new detections, so none of them identifies a plane of the maps before.
        let (frame, seen) = (before.frame, SeenThings::default());
        log.events.set(place, Event::KeyFrame(KeyFrameEntry { frame, observation, seen }));
        let report = self.correct_from(Some(place), poses, &mut |_| true);
        if let Some(log) = &mut self.map.past.log {
            if report.is_ok() {
                log.history.remove(before.observation);
            } else {
                log.history.remove(observation);
                log.events.set(place, Event::KeyFrame(before));
            }
        }
        report
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::FrameId;
    use dymlm_sim::{Sequence, SequenceType};

    use crate::{Detections, FrameOutcome, HistoryConfig, KeyFrameConfig, MapBuilder, MapConfig};

    /// Pixels of a kept observation that are surely a mover's.
    fn surely_movers(builder: &MapBuilder, frame: FrameId) -> usize {
        let log = builder.map.past.log.as_ref().unwrap();
        let (_, entry) = log.key_frame(frame).unwrap();
        log.history.get(entry.observation).unwrap().mover_mask.count()
    }

    /// Regression: what had been predicted in the meantime stayed sure.
    #[test]
    fn nothing_is_surely_a_movers_where_late_detections_find_nobody() {
        let config = MapConfig {
            history: HistoryConfig::Memory,
            key_frames: KeyFrameConfig::every_frame(),
            ..MapConfig::default()
        };
        let mut builder = MapBuilder::new(config).unwrap();
        let mut sequence = SequenceType::WalkingStatic.config();
        (sequence.frames, sequence.frame_rate) = (4, 30.0);
        let mut last = None;
        for (index, frame) in Sequence::new(&sequence).unwrap().frames().enumerate() {
            let found = (index < 3).then_some(&frame.detections[..]);
            let report =
                builder.insert(&frame.frame, Detections::from(found), &frame.world_from_camera).unwrap();
            last = Some(report.id);
        }
        let last = last.unwrap();
        assert!(surely_movers(&builder, last) > 0, "a predicted mover");
        let report = builder.detections_for(last, &[]).unwrap();
        assert!(matches!(report.outcome, FrameOutcome::Mended(_)));
        assert_eq!(surely_movers(&builder, last), 0);
    }
}

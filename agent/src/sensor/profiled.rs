//! The detections of a sensor whose detector has a profile.

use super::{Identified, Sensor};
use crate::detector::{Detector, ObjectReport, Sighting, hidden};
use crate::pose_error::EstimatedPose;
use crate::random::Purpose;
use crate::truth::{ObjectId, TrueObject};
use v2x_common::detection::Detection;
use v2x_common::geometry::BevBox;

impl Sensor {
    /// The detector; `None` for the paper's.
    pub(super) fn detector(&self) -> Option<Detector> {
        let errors = self.config.profile.errors()?;
        Some(Detector::new(errors, self.config.rate.hz(), self.config.detection_probability))
    }

    /// What the detector reports of a frame's objects, and its false detections.
    pub(super) fn profiled_detections(
        &self,
        (detector, objects): (&Detector, &[TrueObject]),
        pose: &EstimatedPose,
        sequence: u64,
    ) -> Vec<Identified> {
        let boxes: Vec<BevBox> = objects.iter().map(|object| object.bev).collect();
        let is_hidden = hidden(&pose.truth, &boxes);
        let mut detected = Vec::new();
        for (object, is_hidden) in objects.iter().zip(is_hidden) {
            if !self.is_visible(object, pose) {
                continue;
            }
            let mut rng = self.rng(sequence, Purpose::Measurement(object.id));
            let measured = self.noise.measure(&object.bev, &pose.truth, &mut rng);
            let range_m = pose.truth.distance_to(object.bev.x, object.bev.y);
            let sighting = Sighting {
                class: object.class,
                truth: &object.bev,
                measured: &measured,
                sensor: &pose.truth,
                sigma_m: self.noise.model().position_sigma_m(range_m),
                is_hidden,
            };
            let draws = |stream, number| self.rng(number, Purpose::Detector(stream, object.id));
            let reports = detector.reports(&sighting, sequence, &draws);
            detected.extend(reports.iter().map(|report| self.profiled(Some(object.id), report, pose)));
        }
        detected.extend(self.false_detections(detector, pose, sequence));
        detected
    }

    fn false_detections<'a>(
        &'a self,
        detector: &Detector,
        pose: &'a EstimatedPose,
        sequence: u64,
    ) -> impl Iterator<Item = Identified> + 'a {
        let since = detector.ghosts_since(sequence);
        let then = self.world.agent_pose(self.index, self.scenario_time(since)).unwrap_or(pose.truth);
        let draws = [self.rng(since, Purpose::FalseObjects), self.rng(sequence, Purpose::Clutter)];
        let per_frame = self.config.clutter_per_frame;
        let ghosts = detector.ghosts(per_frame, (&self.config.field_of_view, &then), draws);
        ghosts.into_iter().map(|ghost| self.profiled(None, &ghost, pose))
    }

    fn profiled(&self, id: Option<ObjectId>, report: &ObjectReport, pose: &EstimatedPose) -> Identified {
        let detection = self.detection(report.class, report.bev, pose);
        (id, Detection { score: report.score, ..detection })
    }
}

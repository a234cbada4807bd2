//! What the two agents report of a keyframe.

use super::noise::{NoisePair, Purpose, Realisation, Shape, perturb, shuffle};
use super::scene::{Keyframe, Scene};
use std::f64::consts::TAU;
use v2x_agent::random::unit;
use v2x_agent::truth::ObjectId;
use v2x_common::detection::Detection;
use v2x_common::geometry::Pose;

/// Agent 2 is drawn from a disc of this radius around agent 1, for every frame anew, m: its mean range in the
/// paper equals agent 1's (METHODS.md 0).
const DISC_RADIUS_M: f64 = 15.0;
/// The paper's detectors are always sure.
const SCORE: f64 = 1.0;

/// How scenes become detections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Protocol {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The shape of the errors.
    pub shape: Shape,
    /// Which errors.
    pub realisation: Realisation,
}

/// What one agent reports of a keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentReport {
    /// Where it is.
    pub pose: Pose,
    /// What it sees, in no meaningful order.
    pub detections: Vec<Detection>,
    /// For each detection the place of its object in the keyframe: for scoring only.
    pub objects: Vec<usize>,
    /// And that object's number.
    pub identities: Vec<ObjectId>,
}

impl Protocol {
    /// What agents 1 and 2 report of a keyframe: everything, once (METHODS.md 0: detection probability 1, no
    /// clutter). The σ that they report follow from the measured range and the measured size, not from the true
    /// ones.
    pub fn observe(&self, scene: &Scene, frame: usize) -> [AgentReport; 2] {
        let keyframe = &scene.keyframes[frame];
        let number = u32::try_from(frame).expect("scenes have fewer than 2^32 keyframes");
        let second = self.second_pose(&scene.name, keyframe, number);
        let of_agent = |agent: u32, pose| self.report(&scene.name, (number, keyframe), (agent, pose));
        [of_agent(0, keyframe.ego), of_agent(1, second)]
    }

    /// Uniform in the disc.
    fn second_pose(&self, scene: &str, keyframe: &Keyframe, frame: u32) -> Pose {
        let mut rng = self.realisation.rng(scene, frame, Purpose::Place);
        let radius_m = DISC_RADIUS_M * libm::sqrt(unit(&mut rng));
        let (sin, cos) = libm::sincos(TAU * unit(&mut rng));
        let Pose { x, y, yaw } = keyframe.ego;
        Pose { x: x + radius_m * cos, y: y + radius_m * sin, yaw }
    }

    fn report(
        &self,
        scene: &str,
        (frame, keyframe): (u32, &Keyframe),
        (agent, pose): (u32, Pose),
    ) -> AgentReport {
        let model = self.noise.levels()[agent as usize].model();
        let rng = |purpose| self.realisation.rng(scene, frame, purpose);
        let mut objects: Vec<usize> = (0..keyframe.objects.len()).collect();
        shuffle(&mut objects, &mut rng(Purpose::Order { agent }));
        let detection = |place: &usize| {
            let object = &keyframe.objects[*place];
            let mut rng = rng(Purpose::Measurement { agent, object: object.id.0 });
            let bev = perturb(&object.bev, &pose, (&model, self.shape), &mut rng);
            Detection {
                class: object.class,
                score: SCORE,
                bev,
                covariance: model.reported_covariance(&bev, &pose),
                velocity: None,
                source_track: None,
            }
        };
        let detections = objects.iter().map(detection).collect();
        let identities = objects.iter().map(|place| keyframe.objects[*place].id).collect();
        AgentReport { pose, detections, objects, identities }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{car, parking, scene_of};
    use super::*;

    pub(crate) const PROTOCOL: Protocol = Protocol {
        noise: NoisePair::N1N1,
        shape: Shape::Gaussian,
        realisation: Realisation { seed: 1, trial: 0 },
    };

    #[test]
    fn every_object_is_reported_once_by_each_agent_in_an_order_of_its_own() {
        let scene = parking(1);
        let reports = PROTOCOL.observe(&scene, 0);
        for report in &reports {
            let mut objects = report.objects.clone();
            objects.sort_unstable();
            assert_eq!(objects, (0..8).collect::<Vec<_>>());
            for (detection, object) in report.detections.iter().zip(&report.objects) {
                let truth = scene.keyframes[0].objects[*object].bev;
                assert!(truth.pose().distance_to(detection.bev.x, detection.bev.y) < 10.0);
            }
        }
        assert_ne!(reports[0].objects, reports[1].objects);
    }

    #[test]
    fn the_second_agent_is_uniform_in_the_disc() {
        let scene = parking(400);
        let distances: Vec<f64> = (0..400)
            .map(|frame| PROTOCOL.observe(&scene, frame)[1].pose)
            .map(|pose| pose.distance_to(0.0, 0.0))
            .collect();
        assert!(distances.iter().all(|distance| *distance <= DISC_RADIUS_M));
        // Half of the disc's area lies within 1/√2 of its radius; standard error of the share 0.025.
        let inner = distances.iter().filter(|distance| **distance < DISC_RADIUS_M / libm::sqrt(2.0)).count();
        assert!((160..240).contains(&inner), "{inner}");
    }

    #[test]
    fn an_objects_errors_do_not_depend_on_what_else_is_there() {
        let alone = scene_of(&[&[car(1, 20.0, 5.0)]]);
        let together = scene_of(&[&[car(0, -8.0, 3.0), car(1, 20.0, 5.0)]]);
        let of_car_1 = |scene: &Scene| {
            let [report, _] = PROTOCOL.observe(scene, 0);
            let place = report.objects.iter().position(|place| scene.keyframes[0].objects[*place].id.0 == 1);
            report.detections[place.unwrap()]
        };
        assert_eq!(of_car_1(&alone), of_car_1(&together));
    }

    #[test]
    fn the_reported_accuracy_follows_from_what_was_measured() {
        let [report, _] = PROTOCOL.observe(&parking(1), 0);
        for detection in &report.detections {
            let range_m = report.pose.distance_to(detection.bev.x, detection.bev.y);
            let sigma_m = 0.2 + 0.01 * range_m;
            assert!((detection.covariance.position.xx - sigma_m * sigma_m).abs() < 1e-12);
            let sigma_w_m = 0.2 * detection.bev.w;
            assert!((detection.covariance.ww - sigma_w_m * sigma_w_m).abs() < 1e-12);
        }
    }
}

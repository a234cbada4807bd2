//! The detections that the two agents report of a keyframe.

use crate::data::conditions::Conditions;
use crate::data::noise::{NoisePair, Purpose, Realisation, Shape, perturb, shuffle};
use crate::data::scene::{Keyframe, Scene, TrueBox};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use v2x_agent::detector::{Detector, ObjectReport, Sighting, hidden};
use v2x_agent::random::{poisson, unit};
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::detection::Detection;
use v2x_common::geometry::{BevBox, Pose};

/// The place of agent 2 is drawn for every frame from a disc of this radius around agent 1, m: its mean range in the
/// paper equals agent 1's (deploy/docs/methods.md).
const DISC_RADIUS_M: f64 = 15.0;
/// The paper's detectors have no confidence scores.
const SCORE: f64 = 1.0;
/// Classes of clutter.
const CLUTTER_CLASSES: [Class; 4] = [Class::Car, Class::Adult, Class::Bicycle, Class::TrafficCone];

/// The rules by which scenes become detections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Protocol {
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The shape of the errors.
    pub shape: Shape,
    /// What agents can see.
    pub conditions: Conditions,
    /// Seed and trial of the errors.
    pub realisation: Realisation,
}

/// The report of one agent of a keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentReport {
    /// Pose of the agent.
    pub pose: Pose,
    /// Its detections, in no meaningful order.
    pub detections: Vec<Detection>,
    /// The true object of each detection, for scoring only; `None` for clutter.
    pub identities: Vec<Option<ObjectId>>,
}

/// One agent in one keyframe.
#[derive(Clone, Copy, Debug)]
struct Observer<'a> {
    scene: &'a str,
    frame: u32,
    keyframe: &'a Keyframe,
    agent: u32,
    pose: Pose,
}

impl Protocol {
    /// The reports of agents 1 and 2. The reported σ follow from the measured range and the measured size, not from the
    /// true ones.
    pub(crate) fn observe(&self, scene: &Scene, frame: usize) -> [AgentReport; 2] {
        let keyframe = &scene.keyframes[frame];
        let rate_hz = rate_hz(scene);
        let (name, number) = (scene.name.as_str(), frame_number(frame));
        let poses = self.poses(name, keyframe, number);
        [0, 1].map(|agent| {
            let pose = poses[agent as usize];
            let observer = Observer { scene: name, frame: number, keyframe, agent, pose };
            match self.conditions.profile().errors() {
                None => self.report(observer),
                Some(errors) => {
                    self.profiled_report(observer, &Detector::new(errors, rate_hz, 1.0), |since| {
                        self.poses(name, &scene.keyframes[since as usize], since)[agent as usize]
                    })
                }
            }
        })
    }

    /// For each object of a keyframe whether any agent covers it. Only covered objects count.
    pub(crate) fn is_in_view(&self, scene: &Scene, frame: usize) -> Vec<bool> {
        let keyframe = &scene.keyframes[frame];
        let poses = self.poses(&scene.name, keyframe, frame_number(frame));
        let seen = |one: &TrueBox| poses.iter().any(|pose| self.sees(pose, &one.bev));
        keyframe.objects.iter().map(seen).collect()
    }

    fn sees(&self, pose: &Pose, bev: &BevBox) -> bool {
        self.conditions.field_of_view().contains_within(pose, bev.x, bev.y, 0.0)
    }

    fn poses(&self, scene: &str, keyframe: &Keyframe, frame: u32) -> [Pose; 2] {
        let Pose { x, y, yaw } = keyframe.ego;
        let (radius_m, direction) = match self.conditions.apart_m() {
            // Uniform in the disc.
            None => {
                let mut rng = self.realisation.rng(scene, frame, Purpose::Place);
                (DISC_RADIUS_M * libm::sqrt(unit(&mut rng)), TAU * unit(&mut rng))
            }
            Some(apart_m) => (apart_m, TAU * unit(&mut self.realisation.rng(scene, 0, Purpose::Place))),
        };
        let (sin, cos) = libm::sincos(direction);
        [keyframe.ego, Pose { x: x + radius_m * cos, y: y + radius_m * sin, yaw }]
    }

    fn report(&self, observer: Observer<'_>) -> AgentReport {
        let Observer { scene, frame, keyframe, agent, pose } = observer;
        let rng = |purpose| self.realisation.rng(scene, frame, purpose);
        let mut report = AgentReport { pose, detections: Vec::new(), identities: Vec::new() };
        let mut places: Vec<usize> = (0..keyframe.objects.len()).collect();
        shuffle(&mut places, &mut rng(Purpose::Order { agent }));
        let p = self.conditions.detection_probability();
        for object in places.iter().map(|place| &keyframe.objects[*place]) {
            let number = object.id.0;
            let detects = || unit(&mut rng(Purpose::Detection { agent, object: number })) < p;
            if self.sees(&pose, &object.bev) && (p >= 1.0 || detects()) {
                let mut rng = rng(Purpose::Measurement { agent, object: number });
                report.detections.push(self.detection((object.class, &object.bev), (agent, &pose), &mut rng));
                report.identities.push(Some(object.id));
            }
        }
        self.add_clutter(&mut report, agent, &mut rng(Purpose::Clutter { agent }));
        report
    }

    /// The report of a detector with a profile. `pose_at` gives the agent's pose in an earlier frame.
    fn profiled_report(
        &self,
        observer: Observer<'_>,
        detector: &Detector,
        pose_at: impl Fn(u32) -> Pose,
    ) -> AgentReport {
        let Observer { scene, frame, keyframe, agent, pose } = observer;
        let rng = |frame, purpose| self.realisation.rng(scene, frame, purpose);
        let boxes: Vec<BevBox> = keyframe.objects.iter().map(|object| object.bev).collect();
        let model = self.noise.levels()[agent as usize].model();
        let mut found: Vec<(Option<ObjectId>, ObjectReport)> = Vec::new();
        for (object, is_hidden) in keyframe.objects.iter().zip(hidden(&pose, &boxes)) {
            if !self.sees(&pose, &object.bev) {
                continue;
            }
            let number = object.id.0;
            let mut of_measurement = rng(frame, Purpose::Measurement { agent, object: number });
            let measured = perturb(&object.bev, &pose, (&model, self.shape), &mut of_measurement);
            let sighting = Sighting {
                class: object.class,
                truth: &object.bev,
                measured: &measured,
                sensor: &pose,
                sigma_m: model.position_sigma_m(pose.distance_to(object.bev.x, object.bev.y)),
                is_hidden,
            };
            let draws = |stream, knot: u64| {
                let knot = u32::try_from(knot).unwrap_or(u32::MAX);
                rng(knot, Purpose::Detector { agent, object: number, stream })
            };
            let reports = detector.reports(&sighting, frame.into(), &draws);
            found.extend(reports.into_iter().map(|report| (Some(object.id), report)));
        }
        let since = u32::try_from(detector.ghosts_since(frame.into())).unwrap_or(frame);
        let draws = [rng(since, Purpose::FalseObjects { agent }), rng(frame, Purpose::Clutter { agent })];
        let view = self.conditions.field_of_view();
        let ghosts = detector.ghosts(self.conditions.clutter_per_frame(), (&view, &pose_at(since)), draws);
        found.extend(ghosts.into_iter().map(|ghost| (None, ghost)));
        shuffle(&mut found, &mut rng(frame, Purpose::Order { agent }));
        let mut report = AgentReport { pose, detections: Vec::new(), identities: Vec::new() };
        for (id, ObjectReport { class, score, bev }) in found {
            let covariance = model.reported_covariance(&bev, &pose);
            let detection = Detection {
                class,
                score,
                bev,
                covariance,
                velocity: None,
                heading: v2x_common::detection::HeadingKind::Known,
                source_track: None,
            };
            report.detections.push(detection);
            report.identities.push(id);
        }
        report
    }

    fn detection(
        &self,
        (class, truth): (Class, &BevBox),
        (agent, pose): (u32, &Pose),
        rng: &mut ChaCha8Rng,
    ) -> Detection {
        let model = self.noise.levels()[agent as usize].model();
        let bev = perturb(truth, pose, (&model, self.shape), rng);
        let covariance = model.reported_covariance(&bev, pose);
        Detection {
            class,
            score: SCORE,
            bev,
            covariance,
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        }
    }

    /// Adds clutter, uniform in the agent's field of view, at random places of the report.
    fn add_clutter(&self, report: &mut AgentReport, agent: u32, rng: &mut ChaCha8Rng) {
        for _ in 0..poisson(rng, self.conditions.clutter_per_frame()) {
            let radius_m = self.conditions.range_m() * libm::sqrt(unit(rng));
            let (sin, cos) = libm::sincos(TAU * unit(rng));
            let class = CLUTTER_CLASSES[rng.random_range(0..CLUTTER_CLASSES.len())];
            let (w, d) = class.typical_size();
            let Pose { x, y, .. } = report.pose;
            let bev = BevBox { x: x + radius_m * cos, y: y + radius_m * sin, w, d, yaw: TAU * unit(rng) };
            let pose = report.pose;
            let detection = self.detection((class, &bev), (agent, &pose), rng);
            let place = rng.random_range(0..=report.detections.len());
            report.detections.insert(place, detection);
            report.identities.insert(place, None);
        }
    }
}

/// Keyframes per second of a scene; 2, as in nuScenes, where it has one only.
fn rate_hz(scene: &Scene) -> f64 {
    match scene.keyframes.as_slice() {
        [first, second, ..] if second.at > first.at => 1.0 / (second.at - first.at).as_secs_f64(),
        _ => 2.0,
    }
}

fn frame_number(frame: usize) -> u32 {
    u32::try_from(frame).expect("scenes have fewer than 2^32 keyframes")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_scenes::{car, parking, scene_of};
    use v2x_common::geometry::wrap_angle;

    pub(crate) const PROTOCOL: Protocol = Protocol {
        noise: NoisePair::N1N1,
        shape: Shape::Gaussian,
        conditions: Conditions::Paper,
        realisation: Realisation { seed: 1, trial: 0 },
    };

    #[test]
    fn every_object_is_reported_once_by_each_agent_in_an_order_of_its_own() {
        let scene = parking(1);
        let reports = PROTOCOL.observe(&scene, 0);
        for report in &reports {
            let mut objects: Vec<u32> = report.identities.iter().flatten().map(|id| id.0).collect();
            objects.sort_unstable();
            assert_eq!(objects, (0..8).collect::<Vec<_>>());
            for (detection, object) in report.detections.iter().zip(report.identities.iter().flatten()) {
                let truth = scene.keyframes[0].objects[object.0 as usize].bev;
                assert!(truth.pose().distance_to(detection.bev.x, detection.bev.y) < 10.0);
            }
        }
        assert_ne!(reports[0].identities, reports[1].identities);
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
            let place = report.identities.iter().position(|one| *one == Some(ObjectId(1)));
            report.detections[place.unwrap()]
        };
        assert_eq!(of_car_1(&alone), of_car_1(&together));
    }

    #[test]
    fn the_reported_accuracy_depends_on_the_measured_size() {
        let [report, _] = PROTOCOL.observe(&parking(1), 0);
        for detection in &report.detections {
            let range_m = report.pose.distance_to(detection.bev.x, detection.bev.y);
            let sigma_m = 0.2 + 0.01 * range_m;
            assert!((detection.covariance.position.xx - sigma_m * sigma_m).abs() < 1e-12);
            let sigma_w_m = 0.2 * detection.bev.w;
            assert!((detection.covariance.ww - sigma_w_m * sigma_w_m).abs() < 1e-12);
        }
    }

    #[test]
    fn sensors_miss_one_in_ten_objects_in_view_and_report_half_a_false_detection_per_frame() {
        let scene = parking(2000);
        let protocol = Protocol { conditions: Conditions::Sensors, ..PROTOCOL };
        let (mut seen, mut reported, mut clutter) = (0, 0, 0);
        for frame in 0..2000 {
            let [report, _] = protocol.observe(&scene, frame);
            let in_view = |one: &&TrueBox| protocol.sees(&report.pose, &one.bev);
            seen += scene.keyframes[frame].objects.iter().filter(in_view).count();
            reported += report.identities.iter().flatten().count();
            clutter += report.identities.iter().filter(|one| one.is_none()).count();
            assert!(report.detections.iter().all(|one| one.bev.pose().distance_to(0.0, 0.0) < 60.0));
        }
        // Four cars in view: 8000 chances, standard error 0.0034; 1000 false reports expected, ± 32.
        let share = reported as f64 / seen as f64;
        assert!((share - 0.9).abs() < 0.015, "{share}");
        assert!((880..1120).contains(&clutter), "{clutter}");
    }

    #[test]
    fn objects_in_view_of_any_agent_are_in_the_ground_truth() {
        let scene =
            scene_of(&[&[car(0, 0.0, 49.0), car(1, 0.0, 91.0), car(2, 0.0, -70.0), car(3, 70.0, 0.0)]]);
        let protocol = Protocol { conditions: Conditions::Sensors, ..PROTOCOL };
        let [_, second] = protocol.poses("test", &scene.keyframes[0], 0);
        assert!((second.distance_to(0.0, 0.0) - 40.0).abs() < 1e-9);
        let expected: Vec<bool> = scene.keyframes[0]
            .objects
            .iter()
            .map(|one| {
                let BevBox { x, y, .. } = one.bev;
                second.distance_to(x, y) <= 50.0 || libm::hypot(x, y) <= 50.0
            })
            .collect();
        assert_eq!(protocol.is_in_view(&scene, 0), expected);
        assert_eq!(PROTOCOL.is_in_view(&scene, 0), [true; 4]);
    }

    #[test]
    fn a_lidar_misses_turns_and_doubles_and_reports_scores_and_false_objects() {
        let scene = parking(400);
        let protocol = Protocol { conditions: Conditions::Lidar, ..PROTOCOL };
        let (mut seen, mut found, mut turned, mut false_ones) = (0.0, 0.0, 0.0, 0.0);
        for frame in 0..400 {
            for report in protocol.observe(&scene, frame) {
                let objects = &scene.keyframes[frame].objects;
                seen += objects.iter().filter(|one| protocol.sees(&report.pose, &one.bev)).count() as f64;
                for (detection, id) in report.detections.iter().zip(&report.identities) {
                    assert!((0.0..1.0).contains(&detection.score) && detection.validate(None).is_ok());
                    match id {
                        Some(id) => {
                            found += 1.0;
                            let truth = objects.iter().find(|one| one.id == *id).unwrap().bev;
                            turned +=
                                f64::from(u8::from(wrap_angle(detection.bev.yaw - truth.yaw).abs() > 2.0));
                        }
                        None => false_ones += 1.0,
                    }
                }
            }
        }
        assert!((0.4..0.97).contains(&(found / seen)), "{found} of {seen}");
        assert!((0.05..0.25).contains(&(turned / found)), "{turned} of {found}");
        assert!((2.5..5.5).contains(&(false_ones / 800.0)), "{false_ones}");
    }
}

//! What a detector reports of one object in one frame.

use super::profile::DetectorProfile;
use crate::random::{DetectorStream as Stream, GaussMarkov, standard_normal, unit};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, SQRT_2};
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose, wrap_angle};

/// An object before a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Sighting<'a> {
    /// Its true class.
    pub class: Class,
    /// Its true box.
    pub truth: &'a BevBox,
    /// A measurement of it with independent errors.
    pub measured: &'a BevBox,
    /// The sensor's true pose.
    pub sensor: &'a Pose,
    /// The sensor's σ of x and of y there, m.
    pub sigma_m: f64,
    /// Whether a nearer object hides it.
    pub is_hidden: bool,
}

/// One reported box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectReport {
    /// The reported class.
    pub class: Class,
    /// The reported confidence, 0 to 1.
    pub score: f64,
    /// The reported box.
    pub bev: BevBox,
}

/// A detector with the errors of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detector {
    profile: DetectorProfile,
    rate_hz: f64,
    detection_probability: f64,
}

impl Detector {
    /// A detector of so many frames per second. `detection_probability` is a factor of the profile's.
    pub const fn new(profile: DetectorProfile, rate_hz: f64, detection_probability: f64) -> Self {
        Self { profile, rate_hz, detection_probability }
    }

    /// The numbers of its errors.
    pub const fn profile(&self) -> &DetectorProfile {
        &self.profile
    }

    /// Frames per second.
    pub const fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// What it reports of an object in a frame: nothing, a box, or two. `draws` gives the draws of a stream for a frame
    /// number, which must depend on nothing else than object, stream and number.
    pub fn reports(
        &self,
        sighting: &Sighting<'_>,
        frame: u64,
        draws: &impl Fn(Stream, u64) -> ChaCha8Rng,
    ) -> Vec<ObjectReport> {
        let profile = &self.profile;
        let range_m = sighting.sensor.distance_to(sighting.truth.x, sighting.truth.y);
        let hidden = if sighting.is_hidden { profile.hidden_factor } else { 1.0 };
        let p = self.detection_probability * profile.detection_at(range_m) * hidden;
        let level = |stream, correlation_s| self.level(stream, correlation_s, (frame, draws));
        if level(Stream::Hits, profile.hit_correlation_s) >= p {
            return Vec::new();
        }
        let mut bev = self.coloured(sighting, (frame, draws));
        if level(Stream::Flips, profile.flips.1) < profile.flips.0 {
            bev.yaw = wrap_angle(bev.yaw + PI);
        }
        let is_confused = level(Stream::Class, profile.confusion.1) < profile.confusion.0;
        let class = if is_confused { confused(sighting.class) } else { sighting.class };
        let [score] = self.process(Stream::Score, profile.hit_correlation_s, (frame, draws));
        let report = ObjectReport { class, score: logistic(profile.score, score), bev };
        let mut rng = draws(Stream::Frame, frame);
        if unit(&mut rng) >= profile.split {
            return vec![report];
        }
        // Half of a box beside the box: what suppression leaves of a long object.
        let (x, y) = bev.pose().offset(0.4 * bev.d, 0.0);
        let second =
            ObjectReport { score: 0.7 * report.score, bev: BevBox { x, y, d: 0.6 * bev.d, ..bev }, ..report };
        vec![report, second]
    }

    /// The score of a false detection with this standard normal draw.
    pub(super) fn false_score(&self, draw: f64) -> f64 {
        logistic(self.profile.false_score, draw)
    }

    /// A process with a uniform law on (0, 1).
    fn level(
        &self,
        stream: Stream,
        correlation_s: f64,
        at: (u64, &impl Fn(Stream, u64) -> ChaCha8Rng),
    ) -> f64 {
        let [z] = self.process(stream, correlation_s, at);
        0.5 * libm::erfc(-z / SQRT_2)
    }

    fn process<const N: usize>(
        &self,
        stream: Stream,
        correlation_s: f64,
        (frame, draws): (u64, &impl Fn(Stream, u64) -> ChaCha8Rng),
    ) -> [f64; N] {
        let steps = GaussMarkov { correlation_frames: correlation_s * self.rate_hz };
        steps.at(frame, &|knot| {
            let mut rng = draws(stream, knot);
            std::array::from_fn(|_| standard_normal(&mut rng))
        })
    }

    /// The measured box with slow errors of its position in place of a part of the independent ones.
    fn coloured(&self, sighting: &Sighting<'_>, at: (u64, &impl Fn(Stream, u64) -> ChaCha8Rng)) -> BevBox {
        let Sighting { truth, measured, sensor, .. } = *sighting;
        let DetectorProfile { slow_errors: (share, correlation_s), along_across, is_by_sight, .. } =
            self.profile;
        let axis = if is_by_sight { sensor.yaw + sensor.bearing_to(truth.x, truth.y) } else { truth.yaw };
        let (sin, cos) = libm::sincos(axis);
        let (x, y) = (measured.x - truth.x, measured.y - truth.y);
        let independent = [cos * x + sin * y, cos * y - sin * x];
        let slow: [f64; 2] = self.process(Stream::Errors, correlation_s, at);
        let sigma_m = sighting.sigma_m;
        let [along, across] = [0, 1].map(|k: usize| {
            along_across[k]
                * (libm::sqrt(share) * sigma_m * slow[k] + libm::sqrt(1.0 - share) * independent[k])
        });
        BevBox {
            x: truth.x + cos * along - sin * across,
            y: truth.y + sin * along + cos * across,
            ..*measured
        }
    }
}

fn logistic((mean, sigma): (f64, f64), draw: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-(mean + sigma * draw)))
}

/// What a class is taken for.
const fn confused(class: Class) -> Class {
    match class {
        Class::Car => Class::Truck,
        Class::Truck => Class::RigidBus,
        Class::RigidBus | Class::BendyBus | Class::ConstructionVehicle | Class::Trailer => Class::Truck,
        Class::Bicycle => Class::Motorcycle,
        Class::Motorcycle => Class::Bicycle,
        Class::Adult | Class::Child => Class::Bicycle,
        _ => Class::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Profile;
    use crate::random::{Purpose, keyed_rng};
    use crate::truth::ObjectId;

    const CAR: BevBox = BevBox { x: 10.0, y: 0.0, w: 1.8, d: 4.5, yaw: 0.3 };
    const SIGMA_M: f64 = 0.4;

    fn draws(object: u32) -> impl Fn(Stream, u64) -> ChaCha8Rng {
        move |stream, number| keyed_rng(3, None, number, Purpose::Detector(stream, ObjectId(object)))
    }

    /// What a lidar reports of a car in so many frames at 10 Hz, frame by frame.
    fn reported(object: u32, frames: u64) -> Vec<Vec<ObjectReport>> {
        let detector = Detector::new(Profile::Lidar.errors().unwrap(), 10.0, 1.0);
        let draws = draws(object);
        let report = |frame| {
            let mut rng = keyed_rng(4, None, frame, Purpose::Measurement(ObjectId(object)));
            let mut error = || SIGMA_M * standard_normal(&mut rng);
            let measured = BevBox { x: CAR.x + error(), y: CAR.y + error(), ..CAR };
            let sighting = Sighting {
                class: Class::Car,
                truth: &CAR,
                measured: &measured,
                sensor: &Pose::default(),
                sigma_m: SIGMA_M,
                is_hidden: false,
            };
            detector.reports(&sighting, frame, &draws)
        };
        (0..frames).map(report).collect()
    }

    /// Shares over many cars and frames: of `what`, and of it where it held in the frame before.
    fn shares(what: impl Fn(&[ObjectReport]) -> Option<bool>) -> (f64, f64) {
        let (mut n, mut held, mut pairs, mut kept) = (0.0, 0.0, 0.0, 0.0);
        for object in 0..60 {
            let mut before = None;
            for now in reported(object, 400).iter().map(|reports| what(reports)) {
                if let Some(now) = now {
                    n += 1.0;
                    held += f64::from(u8::from(now));
                    if before == Some(true) {
                        pairs += 1.0;
                        kept += f64::from(u8::from(now));
                    }
                }
                before = now;
            }
        }
        (held / n, kept / pairs)
    }

    #[test]
    fn misses_and_turned_headings_have_their_shares_and_last() {
        let (hit, again) = shares(|reports| Some(!reports.is_empty()));
        assert!((hit - 0.95).abs() < 0.03 && again > hit + 0.02, "{hit} {again}");
        let is_turned = |report: &ObjectReport| (wrap_angle(report.bev.yaw - CAR.yaw)).abs() > 1.0;
        let (turned, again) = shares(|reports| reports.first().map(is_turned));
        assert!((turned - 0.14).abs() < 0.05 && (0.9..0.99).contains(&again), "{turned} {again}");
        let (confused, _) = shares(|reports| reports.first().map(|one| one.class != Class::Car));
        assert!((confused - 0.03).abs() < 0.02, "{confused}");
        let (split, _) = shares(|reports| Some(reports.len() == 2));
        assert!((split - 0.0095).abs() < 0.003, "{split}");
    }

    #[test]
    fn position_errors_keep_their_size_and_are_correlated_over_seconds() {
        let (mut squares, mut products, mut n) = (0.0, 0.0, 0.0);
        for object in 0..60 {
            let frames = reported(object, 400);
            let error = |reports: &Vec<ObjectReport>| {
                reports.first().map(|one| [one.bev.x - CAR.x, one.bev.y - CAR.y])
            };
            for pair in frames.windows(11) {
                let (Some(now), Some(later)) = (error(&pair[0]), error(&pair[10])) else { continue };
                n += 1.0;
                squares += now[0] * now[0] + now[1] * now[1];
                products += now[0] * later[0] + now[1] * later[1];
            }
        }
        let (sigma_m, correlation) = (libm::sqrt(squares / n / 2.0), products / squares);
        assert!((sigma_m / SIGMA_M - 1.0).abs() < 0.1, "{sigma_m}");
        // 0.8 e^(-1 s / 5 s) after a second.
        assert!((correlation - 0.655).abs() < 0.08, "{correlation}");
    }

    #[test]
    fn a_frame_is_the_same_without_those_before_it() {
        assert_eq!(reported(1, 50)[49], {
            let all = reported(1, 60);
            all[49].clone()
        });
    }
}

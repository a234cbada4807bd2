//! Any sequence of frames, descriptions and times, made from bytes: the fuzzer's input of the engine
//! (`tests/fuzz`), here from random bytes.

use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind, SizeNoiseLaw};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::PRESETS;

const AGENTS: [&str; 4] = ["ego", "rsu", "van", "cam"];

/// Reads numbers off bytes, zeros when there are no more.
struct Source<'a>(&'a [u8]);

impl Source<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    fn signed(&mut self) -> f64 {
        f64::from(self.word().cast_signed())
    }

    /// Mostly an ordinary length, sometimes an arbitrary number.
    fn number(&mut self) -> f64 {
        if self.byte() > 250 {
            let bits = [self.byte(), self.byte(), self.byte(), self.byte()];
            return f64::from(f32::from_le_bytes(bits));
        }
        self.signed() / 256.0
    }

    /// A width or depth: mostly a valid one.
    fn extent(&mut self) -> f64 {
        let word = self.word();
        if word > 65_000 { self.number() } else { 0.001 * f64::from(word.max(1)) }
    }

    /// A standard deviation from 1 mm to 66 m.
    fn sigma(&mut self) -> f64 {
        0.001 * (1.0 + f64::from(self.word()))
    }

    fn variance(&mut self) -> f64 {
        let sigma = self.sigma();
        sigma * sigma
    }

    fn covariance(&mut self) -> Covariance2 {
        let (sx, sy, rho) = (self.sigma(), self.sigma(), self.signed() / 32_768.0);
        Covariance2 { xx: sx * sx, xy: rho * sx * sy, yy: sy * sy }
    }

    fn detection(&mut self) -> Detection {
        let flags = self.byte();
        let bev = BevBox {
            x: self.number(),
            y: self.number(),
            w: self.extent(),
            d: self.extent(),
            yaw: self.signed() / 10_430.0,
        };
        let covariance = BoxCovariance {
            position: self.covariance(),
            ww: self.variance(),
            dd: self.variance(),
            yaw: 0.01,
        };
        let velocity = (flags & 1 != 0).then(|| Velocity {
            x: self.number(),
            y: self.number(),
            covariance: self.covariance(),
        });
        let source_track = (flags & 2 != 0).then(|| u64::from(self.byte()));
        let class = Class::ALL[usize::from(flags >> 3) % Class::ALL.len()];
        Detection {
            class,
            score: 0.5,
            bev,
            covariance,
            velocity,
            heading: v2x_common::detection::HeadingKind::Axis,
            source_track,
        }
    }

    fn frame(&mut self, now: Timestamp) -> DetectionFrame {
        let flags = self.byte();
        let agent = AGENTS[usize::from(flags) % AGENTS.len()];
        let captured_at = now + Span::from_micros(i64::from(self.word().cast_signed()) * 16);
        let sequence = u64::from(self.word());
        let sensor_pose = (flags & 8 != 0).then(|| Pose { x: self.number(), y: self.number(), yaw: 0.5 });
        let count = if flags & 128 != 0 { self.byte() % 64 } else { self.byte() % 8 };
        DetectionFrame {
            id: FrameId { agent: AgentId::new(agent).expect("a legal name"), epoch: 1, sequence },
            captured_at,
            sensor_pose,
            sensor_revision: 0,
            map_frame: None,
            detections: (0..count).map(|_| self.detection()).collect(),
        }
    }

    fn description(&mut self) -> SensorDescription {
        let size_noise = (self.byte() & 1 != 0).then(|| SizeNoiseLaw {
            sigma: f64::from(self.byte()) / 100.0,
            lower: f64::from(self.byte()) / 200.0,
        });
        SensorDescription {
            revision: 1,
            kind: SensorKind::RoadsideUnit,
            field_of_view: FieldOfView {
                width_rad: f64::from(self.byte()) / 40.0,
                ..FieldOfView::omnidirectional(self.number().abs(), 200.0)
            },
            detection_probability: f64::from(self.byte()) / 255.0,
            clutter_per_m2: f64::from(self.byte()) * 1e-5,
            size_noise,
            body: None,
            accuracy: Accuracy { position_m: 0.1, yaw_rad: 0.01, clock_s: 0.0 },
            rate_hz: 10.0,
        }
    }
}

/// Runs an engine on the input that the bytes encode. Panics where it breaks a promise: finite numbers, time that never
/// runs back, one track for each id, and fused frames that the wire can hold. Returns how many frames were sent and
/// how many of them were accepted.
pub(crate) fn run(bytes: &[u8]) -> (usize, usize) {
    let mut source = Source(bytes);
    // Half of the time a valid one, else arbitrary.
    let choice = usize::from(source.byte());
    let method = if choice.is_multiple_of(2) { &PRESETS[0] } else { &PRESETS[choice / 2 % PRESETS.len()] };
    let config = EngineConfig::new(HubId::new("hub").expect("a legal name"), 1).with_preset(method);
    let mut engine = Engine::new(config);
    let mut now = Timestamp::EPOCH + Span::from_millis(1_000_000);
    let (mut sent, mut accepted) = (0, 0);
    while !source.0.is_empty() {
        match source.byte() % 8 {
            0 => now += Span::from_millis(i64::from(source.byte())),
            1 => {
                let description = source.description();
                let agent = AGENTS[usize::from(source.byte()) % AGENTS.len()];
                if description.validate().is_ok() {
                    let agent = AgentId::new(agent).expect("a legal name");
                    assert!(engine.handle_description(agent, description).is_ok(), "decoded, and so valid");
                }
            }
            2 => check(&mut engine, now),
            _ => {
                let frame = source.frame(now);
                sent += 1;
                if frame.validate().is_ok() {
                    let disposition = engine.handle_frame(&frame, now);
                    accepted += usize::from(matches!(disposition, Disposition::Accepted { .. }));
                }
            }
        }
    }
    check(&mut engine, now);
    (sent, accepted)
}

fn check(engine: &mut Engine, now: Timestamp) {
    let fused = engine.fused(now).clone();
    assert!(fused.objects.is_sorted_by(|a, b| a.track < b.track), "one object for each track, by id");
    for object in &fused.objects {
        let BevBox { x, y, w, d, yaw } = object.bev;
        let numbers = [x, y, w, d, yaw, object.velocity.0, object.velocity.1, object.existence];
        assert!(numbers.iter().all(|number| number.is_finite()), "{object:?}");
        assert!(object.kinematic_covariance.iter().all(|value| value.is_finite()), "{object:?}");
        assert!((0.0..=1.0).contains(&object.existence), "{object:?}");
    }
    let mut encoded = Vec::new();
    if wire::fused::encode(&fused, &mut encoded).is_ok() {
        wire::fused::decode(&encoded).expect("what is encoded can be decoded");
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn no_sequence_of_valid_frames_is_a_fault_for_the_engine(bytes in prop::collection::vec(any::<u8>(), 0..4000)) {
            super::run(&bytes);
        }
    }

    #[test]
    fn most_random_frames_are_accepted() {
        use rand_chacha::ChaCha8Rng;
        use rand_chacha::rand_core::{Rng, SeedableRng};
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut bytes = vec![0; 100_000];
        rng.fill_bytes(&mut bytes);
        let (sent, accepted) = super::run(&bytes);
        assert!(sent > 150 && 2 * accepted > sent, "{accepted} of {sent} frames");
    }
}

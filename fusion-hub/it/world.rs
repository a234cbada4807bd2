//! A few objects far apart, and agents that report them with given errors.

use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::fusion::{Births, Hypotheses, ParticleCount};

pub(crate) const SIGMA_M: f64 = 0.3;

pub(crate) fn at(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(1_000_000 + ms)
}

/// Sensors report nothing false: the first detection counts.
pub(crate) fn config() -> EngineConfig {
    let config = EngineConfig::new(HubId::new("hub").expect("test input"), 1);
    config.with_tracking(|tracking| tracking.births = Births::AtOnce)
}

pub(crate) fn engine() -> Engine {
    Engine::new(config())
}

/// An engine with this many hypotheses.
pub(crate) fn engine_of_particles(n: u32) -> Engine {
    let config = config();
    let hypotheses = ParticleCount::new(n).map_or(Hypotheses::ONE, Hypotheses::Particles);
    Engine::new(config.with_tracking(|tracking| tracking.tracker.hypotheses = hypotheses))
}

pub(crate) fn agent(name: &str) -> AgentId {
    AgentId::new(name).expect("test input")
}

pub(crate) fn description(clutter_per_m2: f64) -> SensorDescription {
    SensorDescription {
        revision: 1,
        kind: SensorKind::RoadsideUnit,
        field_of_view: FieldOfView::omnidirectional(0.0, 200.0),
        detection_probability: 0.95,
        clutter_per_m2,
        size_noise: None,
        body: None,
        accuracy: Accuracy { position_m: 0.02, yaw_rad: 1e-3, clock_s: 1e-6 },
        rate_hz: 10.0,
    }
}

/// A car driving east at 10 m/s, one lane of 50 m for each object.
pub(crate) fn detection(object: u32, captured_at: Timestamp, error: (f64, f64)) -> Detection {
    let t = (captured_at - at(0)).as_secs_f64();
    Detection {
        class: Class::Car,
        score: 1.0,
        bev: BevBox {
            x: 10.0 * t + error.0,
            y: 50.0 * f64::from(object) + error.1,
            w: 1.8,
            d: 4.5,
            yaw: 0.0,
        },
        covariance: BoxCovariance { position: Covariance2::isotropic(SIGMA_M), ww: 0.1, dd: 0.6, yaw: 0.01 },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

pub(crate) fn frame(
    agent: AgentId,
    sequence: u64,
    captured_ms: i64,
    detections: Vec<Detection>,
) -> DetectionFrame {
    DetectionFrame {
        id: FrameId { agent, epoch: 1, sequence },
        captured_at: at(captured_ms),
        sensor_pose: Some(Pose { x: 0.0, y: 50.0, yaw: 0.0 }),
        sensor_revision: 1,
        map_frame: None,
        detections,
    }
}

/// Numbers that repeat in no short period, in 0 to 1: of a frame, a sensor, and what they are for.
pub(crate) fn draw(k: i64, sensor: i64, what: i64) -> f64 {
    let mut mixed = (k.cast_unsigned() << 24) ^ (sensor.cast_unsigned() << 16) ^ what.cast_unsigned();
    for _ in 0..2 {
        mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
    (mixed >> 11) as f64 / (1_u64 << 53) as f64
}

/// A report of an object of typical size that points east, with this variance of its position along an axis, m².
pub(crate) fn box_of(class: Class, variance: f64, [x, y]: [f64; 2]) -> Detection {
    let (w, d) = class.typical_size();
    Detection {
        class,
        score: 1.0,
        bev: BevBox { x, y, w, d, yaw: 0.0 },
        covariance: BoxCovariance {
            position: Covariance2::isotropic(variance),
            ww: 0.01 * w * w,
            dd: 0.01 * d * d,
            yaw: 0.01,
        },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

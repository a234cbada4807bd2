//! One frame of each kind, exactly as version 1 of the wire decodes it. The example `golden` writes them.
//!
//! The numbers restate the wire's resolution independently of the codec: millimetres, 0.1 mrad, and standard
//! deviations as powers of one ratio.

use std::f64::consts::TAU;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::fused::{
    AgentHealth, FusedFrame, FusedObject, Inclusion, KINEMATIC_INDEX, KinematicCovariance,
};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId, MapFrame, MeasurementId, TrackId};
use v2x_common::lists::DeltaFrame;
use v2x_common::sensor::{Accuracy, Body, FieldOfView, SensorDescription, SensorKind, SizeNoiseLaw};
use v2x_common::time::{Span, Timestamp};

/// 2026-09-21 13:46:40 UTC and some nanoseconds.
const CAPTURED_AT_NS: i64 = 1_789_998_400_123_456_789;

fn agent(name: &str) -> AgentId {
    AgentId::new(name).expect("a legal name")
}

/// Whole millimetres, in m.
fn mm(steps: f64) -> f64 {
    steps * 1e-3
}

/// Steps of 0.1 mrad, in rad.
fn angle(steps: i16) -> f64 {
    f64::from(steps) * 1e-4
}

/// Variance of the step-th standard deviation from `smallest`; 255 steps of the ratio are a factor 70 000.
fn variance(step: u8, smallest: f64) -> f64 {
    let sigma = smallest * (0..step).fold(1.0, |scale, _| scale * 1.044_721_144_087_336_7);
    sigma * sigma
}

/// In m² or m²/s².
fn metric(step: u8) -> f64 {
    variance(step, 1e-3)
}

/// In rad².
fn angular(step: u8) -> f64 {
    variance(step, 1e-4)
}

/// Two standard deviations in steps, and a correlation in 1/128.
fn covariance(x: u8, y: u8, rho: i8) -> Covariance2 {
    let (xx, yy) = (metric(x), metric(y));
    Covariance2 { xx, xy: f64::from(rho) / 128.0 * libm::sqrt(xx * yy), yy }
}

fn map_frame() -> Option<MapFrame> {
    Some(MapFrame::new("EPSG:32632").expect("a legal name"))
}

/// A sensor at UTM coordinates and three detections: with velocity, with a source track, with neither.
pub(crate) fn detection_frame() -> DetectionFrame {
    let (east, north) = (mm(500_000_123.0), mm(5_400_000_456.0));
    let at = |x: f64, y: f64| (east + mm(x), north + mm(y));
    let car = Detection {
        class: Class::Car,
        score: 1.0,
        bev: bev(at(12_345.0, -6_789.0), (1_850.0, 4_520.0), 15_708),
        covariance: BoxCovariance {
            position: covariance(124, 131, -37),
            ww: metric(120),
            dd: metric(140),
            yaw: angular(139),
        },
        velocity: Some(Velocity { x: mm(13_889.0), y: mm(-250.0), covariance: covariance(150, 151, 127) }),
        heading: HeadingKind::Known,
        source_track: None,
    };
    let pedestrian = Detection {
        class: Class::Adult,
        score: 51.0 / 255.0,
        bev: bev(at(-1.0, 59_999.0), (1.0, 65_000.0), -31_415),
        covariance: BoxCovariance {
            position: covariance(0, 255, 0),
            ww: metric(0),
            dd: metric(255),
            yaw: angular(255),
        },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: Some(u64::MAX),
    };
    let cone = Detection {
        class: Class::TrafficCone,
        score: 0.0,
        bev: BevBox { yaw: angle(31_416) - TAU, ..bev(at(0.0, 0.0), (400.0, 400.0), 0) },
        covariance: BoxCovariance {
            position: covariance(1, 2, 3),
            ww: metric(4),
            dd: metric(5),
            yaw: angular(6),
        },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    };
    DetectionFrame {
        id: FrameId { agent: agent("rsu-north.1"), epoch: 1_789_998_000_000_000, sequence: 4_001 },
        captured_at: Timestamp::from_nanos(CAPTURED_AT_NS),
        sensor_pose: Some(Pose { x: east, y: north, yaw: angle(-7_854) }),
        sensor_revision: 3,
        map_frame: map_frame(),
        detections: vec![car, pedestrian, cone],
    }
}

fn bev((x, y): (f64, f64), (w, d): (f64, f64), yaw: i16) -> BevBox {
    BevBox { x, y, w: mm(w), d: mm(d), yaw: angle(yaw) }
}

/// A vehicle with a forward sector, a size law and a body.
pub(crate) fn sensor_description() -> SensorDescription {
    SensorDescription {
        revision: 3,
        kind: SensorKind::Vehicle,
        field_of_view: FieldOfView { range_min_m: 1.5, range_max_m: 60.0, azimuth_rad: 0.25, width_rad: 2.1 },
        detection_probability: 0.95,
        clutter_per_m2: 4.42e-5,
        size_noise: Some(SizeNoiseLaw { sigma: 0.1, lower: 0.5 }),
        body: Some(Body { class: Class::Car, w: 1.8, d: 4.5 }),
        accuracy: Accuracy { position_m: 0.02, yaw_rad: 3.5e-4, clock_s: 1e-6 },
        rate_hz: 10.0,
    }
}

/// Two agents and two objects at UTM coordinates, one of them tracked since before the hub's restart.
pub(crate) fn fused_frame() -> FusedFrame {
    let fused_at = Timestamp::from_nanos(CAPTURED_AT_NS + 42_000_111);
    let (ego, rsu) = (agent("ego"), agent("rsu-north.1"));
    let before = |nanos: i64| fused_at - Span::from_nanos(nanos);
    let ego_frame = FrameId { agent: ego, epoch: 1_789_998_000_000_001, sequence: 3_999 };
    let rsu_frame = FrameId { agent: rsu, epoch: 1_789_998_000_000_000, sequence: 4_001 };
    let rebooted = FrameId { agent: rsu, epoch: 1_789_990_000_000_000, sequence: u64::MAX };
    FusedFrame {
        hub: HubId::new("hub-1").expect("a legal name"),
        lineage: 0xdead_beef,
        sequence: 1_234_567,
        fused_at,
        map_frame: map_frame(),
        objects: vec![
            revived_bus(before(80_000_000), rebooted),
            parked_car(before(42_000_111), ego_frame, rsu_frame),
        ],
        agents: vec![
            health(ego_frame, before(52_000_000), [3_990, 9, 120]),
            health(rsu_frame, before(42_000_111), [4_000, 0, 1]),
        ],
        includes: vec![
            Inclusion { frame: rsu_frame, captured_at: before(42_000_111), received_at: before(1_000) },
            Inclusion { frame: ego_frame, captured_at: before(52_000_000), received_at: before(-1) },
        ],
    }
}

/// What has changed since three frames before: the objects of [`fused_frame`], and two tracks are gone.
pub(crate) fn delta_frame() -> DeltaFrame {
    let list = fused_frame();
    DeltaFrame {
        hub: list.hub,
        lineage: list.lineage,
        sequence: list.sequence,
        fused_at: list.fused_at,
        map_frame: list.map_frame,
        key_sequence: list.sequence - 3,
        changed: list.objects.iter().map(FusedObject::without_contributors).collect(),
        gone: vec![TrackId::new(0xdead_beee, 18), TrackId::new(0xdead_beef, 300)],
    }
}

fn health(newest: FrameId, newest_captured_at: Timestamp, counts: [u64; 3]) -> AgentHealth {
    let [accepted, refused, out_of_sequence] = counts;
    AgentHealth {
        agent: newest.agent,
        epoch: newest.epoch,
        newest_captured_at,
        accepted,
        refused,
        out_of_sequence,
    }
}

fn revived_bus(last_measured_at: Timestamp, measured_in: FrameId) -> FusedObject {
    FusedObject {
        track: TrackId::new(0xdead_beee, 17),
        class: Class::RigidBus,
        class_probabilities: vec![(Class::RigidBus, 204.0 / 255.0), (Class::Truck, 51.0 / 255.0)],
        class_conflict: 0.0,
        bev: bev((mm(500_012_468.0), mm(5_399_993_667.0)), (2_550.0, 12_000.0), 31_415),
        velocity: (mm(-8_333.0), mm(4.0)),
        kinematic_covariance: kinematic([100, 101, 110, 111], [-20, 90, 1, -2, 89, 15]),
        ww: metric(90),
        dd: metric(100),
        yaw_variance: angular(80),
        heading: HeadingKind::Known,
        existence: 1.0,
        age: Span::from_nanos(3_600_000_000_001),
        last_measured_at,
        contributors: vec![MeasurementId { frame: measured_in, index: 4_095 }],
    }
}

fn parked_car(last_measured_at: Timestamp, ego: FrameId, rsu: FrameId) -> FusedObject {
    FusedObject {
        track: TrackId::new(0xdead_beef, 1),
        class: Class::Car,
        class_probabilities: vec![(Class::Car, 1.0)],
        class_conflict: 0.0,
        bev: bev((mm(500_000_000.0), mm(5_400_060_500.0)), (1_850.0, 4_520.0), 0),
        velocity: (0.0, 0.0),
        kinematic_covariance: kinematic([0, 255, 1, 254], [0; 6]),
        ww: metric(0),
        dd: metric(255),
        yaw_variance: angular(255),
        heading: HeadingKind::Known,
        existence: 127.0 / 255.0,
        age: Span::ZERO,
        last_measured_at,
        contributors: vec![MeasurementId { frame: ego, index: 0 }, MeasurementId { frame: rsu, index: 300 }],
    }
}

fn kinematic(sigma: [u8; 4], rho: [i8; 6]) -> KinematicCovariance {
    let variances = sigma.map(metric);
    let mut rho = rho.into_iter();
    KINEMATIC_INDEX.map(|(row, column)| {
        if row == column {
            return variances[row];
        }
        let rho = rho.next().expect("six pairs are off the diagonal");
        f64::from(rho) / 128.0 * libm::sqrt(variances[row] * variances[column])
    })
}

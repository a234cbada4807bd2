//! Arbitrary valid frames.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use std::f64::consts::PI;
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

pub(crate) fn detection_frame() -> impl Strategy<Value = DetectionFrame> {
    let sensor = (option::of(pose()), any::<u32>(), option::of(map_frame()));
    (frame_id(), time(), sensor).prop_flat_map(
        |(id, captured_at, (sensor_pose, sensor_revision, map_frame))| {
            // Without a pose the detections lie anywhere on the map, also at UTM coordinates.
            let around = sensor_pose.unwrap_or(Pose { x: 500_000.0, y: 5_400_000.0, yaw: 0.0 });
            vec(detection(around), 0..12).prop_map(move |detections| DetectionFrame {
                id,
                captured_at,
                sensor_pose,
                sensor_revision,
                map_frame,
                detections,
            })
        },
    )
}

pub(crate) fn detection(around: Pose) -> impl Strategy<Value = Detection> {
    let velocity = (-150.0..150.0, -150.0..150.0, covariance2());
    let velocity = velocity.prop_map(|(x, y, covariance)| Velocity { x, y, covariance });
    (
        class(),
        0.0..=1.0,
        bev(around, 9_999.0),
        box_covariance(),
        option::of(velocity),
        heading_kind(),
        option::of(any::<u64>()),
    )
        .prop_map(|(class, score, bev, covariance, velocity, heading, source_track)| Detection {
            class,
            score,
            bev,
            covariance,
            velocity,
            heading,
            source_track,
        })
}

fn heading_kind() -> impl Strategy<Value = HeadingKind> {
    prop_oneof![Just(HeadingKind::Known), Just(HeadingKind::Axis), Just(HeadingKind::Unknown)]
}

pub(crate) fn sensor_description() -> impl Strategy<Value = SensorDescription> {
    let kind = prop_oneof![Just(SensorKind::Vehicle), Just(SensorKind::RoadsideUnit)];
    let field_of_view = (0.0..10.0, 10.1..10_000.0, -2.0 * PI..2.0 * PI, 0.01..2.0 * PI);
    let law = (0.001..10.0, 0.0..0.999).prop_map(|(sigma, lower)| SizeNoiseLaw { sigma, lower });
    let body = (class(), 0.1..64.0, 0.1..64.0).prop_map(|(class, w, d)| Body { class, w, d });
    let accuracy = (0.0..10.0, 0.0..1.0, 0.0..1.0);
    let numbers = (any::<u32>(), 0.0..=1.0, 0.0..1.0, 0.1..1000.0);
    (kind, field_of_view, option::of(law), option::of(body), accuracy, numbers).prop_map(
        |(kind, (range_min_m, range_max_m, azimuth_rad, width_rad), size_noise, body, accuracy, numbers)| {
            let (position_m, yaw_rad, clock_s) = accuracy;
            let (revision, detection_probability, clutter_per_m2, rate_hz) = numbers;
            SensorDescription {
                revision,
                kind,
                field_of_view: FieldOfView { range_min_m, range_max_m, azimuth_rad, width_rad },
                detection_probability,
                clutter_per_m2,
                size_noise,
                body,
                accuracy: Accuracy { position_m, yaw_rad, clock_s },
                rate_hz,
            }
        },
    )
}

pub(crate) fn fused_frame() -> impl Strategy<Value = FusedFrame> {
    let hub = name().prop_map(|text| HubId::new(&text).unwrap());
    let head = (hub, any::<u32>(), any::<u64>(), time(), option::of(map_frame()), pose());
    (head, vec(agent_health(), 1..5)).prop_flat_map(
        |((hub, lineage, sequence, fused_at, map_frame, at), agents)| {
            let agents = by_name(agents);
            let objects = vec(fused_object(at, agents.clone()), 0..6);
            (objects, vec(inclusion(agents.clone()), 0..4)).prop_map(move |(objects, includes)| FusedFrame {
                hub,
                lineage,
                sequence,
                fused_at,
                map_frame,
                objects,
                agents: agents.clone(),
                includes,
            })
        },
    )
}

pub(crate) fn delta_frame() -> impl Strategy<Value = DeltaFrame> {
    let gone = vec(any::<u64>().prop_map(TrackId), 0..4);
    (fused_frame(), any::<u64>(), gone).prop_map(|(list, key_sequence, gone)| DeltaFrame {
        hub: list.hub,
        lineage: list.lineage,
        sequence: list.sequence,
        fused_at: list.fused_at,
        map_frame: list.map_frame,
        key_sequence,
        changed: list.objects.iter().map(FusedObject::without_contributors).collect(),
        gone,
    })
}

fn by_name(mut agents: Vec<AgentHealth>) -> Vec<AgentHealth> {
    agents.sort_by_key(|health| health.agent);
    agents.dedup_by_key(|health| health.agent);
    agents
}

fn fused_object(around: Pose, agents: Vec<AgentHealth>) -> impl Strategy<Value = FusedObject> {
    let kinematics = ((-150.0..150.0, -150.0..150.0), kinematic_covariance());
    let life = (0.0..=1.0, heading_kind(), 0..i64::from(u32::MAX), time());
    let shape = (bev(around, 1e6), sigma_m(), sigma_m(), sigma_rad());
    let measurement = (frame_of(agents), any::<u16>());
    let measurement = measurement.prop_map(|(frame, index)| MeasurementId { frame, index });
    (any::<u64>(), (classes(), conflict()), shape, kinematics, life, vec(measurement, 0..4)).prop_map(
        |(
            track,
            (classes, class_conflict),
            (bev, sw, sd, st),
            (velocity, kinematic_covariance),
            life,
            contributors,
        )| {
            let (existence, heading, age_us, last_measured_at) = life;
            FusedObject {
                track: TrackId(track),
                class: classes[0].0,
                class_probabilities: classes,
                class_conflict,
                bev,
                velocity,
                kinematic_covariance,
                ww: sw * sw,
                dd: sd * sd,
                yaw_variance: st * st,
                heading,
                existence,
                age: Span::from_nanos(1000 * age_us + 1),
                last_measured_at,
                contributors,
            }
        },
    )
}

/// Mostly none.
fn conflict() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0..=1.0]
}

fn classes() -> impl Strategy<Value = Vec<(Class, f64)>> {
    prop_oneof![
        class().prop_map(|class| vec![(class, 1.0)]),
        (class(), class(), 0.5..=1.0).prop_map(|(one, other, p)| vec![(one, p), (other, 1.0 - p)]),
    ]
}

/// The product of a random triangular matrix with its transpose: positive definite, with correlations up
/// to nearly 1.
fn kinematic_covariance() -> impl Strategy<Value = KinematicCovariance> {
    (prop::array::uniform4(0.002..30.0f64), prop::array::uniform6(-1.0..1.0f64), 0.05..1.0f64).prop_map(
        |(sigma, mix, own)| {
            let mut mix = mix.into_iter();
            let mut factor = [[0.0; 4]; 4];
            for row in 0..4 {
                factor[row][row] = own;
                factor[row][..row].fill_with(|| mix.next().expect("six places below the diagonal"));
                let norm = libm::sqrt(factor[row].iter().map(|value| value * value).sum());
                factor[row].iter_mut().for_each(|value| *value *= sigma[row] / norm);
            }
            KINEMATIC_INDEX.map(|(row, column)| (0..4).map(|k| factor[row][k] * factor[column][k]).sum())
        },
    )
}

fn agent_health() -> impl Strategy<Value = AgentHealth> {
    (frame_id(), time(), any::<[u64; 3]>()).prop_map(|(newest, newest_captured_at, counts)| {
        let [accepted, refused, out_of_sequence] = counts;
        AgentHealth {
            agent: newest.agent,
            epoch: newest.epoch,
            newest_captured_at,
            accepted,
            refused,
            out_of_sequence,
        }
    })
}

fn inclusion(agents: Vec<AgentHealth>) -> impl Strategy<Value = Inclusion> {
    (frame_of(agents), time(), time()).prop_map(|(frame, captured_at, received_at)| Inclusion {
        frame,
        captured_at,
        received_at,
    })
}

fn frame_of(agents: Vec<AgentHealth>) -> impl Strategy<Value = FrameId> {
    (prop::sample::select(agents), option::of(any::<u64>()), any::<u64>()).prop_map(
        |(health, epoch, sequence)| FrameId {
            agent: health.agent,
            epoch: epoch.unwrap_or(health.epoch),
            sequence,
        },
    )
}

fn frame_id() -> impl Strategy<Value = FrameId> {
    (name(), any::<u64>(), any::<u64>()).prop_map(|(name, epoch, sequence)| FrameId {
        agent: AgentId::new(&name).unwrap(),
        epoch,
        sequence,
    })
}

fn map_frame() -> impl Strategy<Value = MapFrame> {
    (1000..33_000u16).prop_map(|code| MapFrame::new(&format!("EPSG:{code}")).unwrap())
}

fn name() -> impl Strategy<Value = String> {
    let letters = prop::sample::select("abcxyzABCXYZ0189-_.:".chars().collect::<Vec<_>>());
    let name = vec(letters, 1..=32).prop_map(String::from_iter);
    name.prop_filter("as the name of a folder it means another one", |name| !matches!(&**name, "." | ".."))
}

/// Any nanosecond from 1970 to 2116: differences of two fit 64 bits.
fn time() -> impl Strategy<Value = Timestamp> {
    (0..i64::MAX / 2).prop_map(Timestamp::from_nanos)
}

fn class() -> impl Strategy<Value = Class> {
    prop::sample::select(Class::ALL.to_vec())
}

fn pose() -> impl Strategy<Value = Pose> {
    let place = prop_oneof![
        (-1e3..1e3, -1e3..1e3),
        (499_000.0..501_000.0, 5_399_000.0..5_401_000.0),
        (-9.9e7..9.9e7, -9.9e7..9.9e7)
    ];
    (place, heading()).prop_map(|((x, y), yaw)| Pose { x, y, yaw })
}

/// Often within a step of half a turn, where the sign is easily lost.
fn heading() -> impl Strategy<Value = f64> {
    prop_oneof![3 => -PI..=PI, 1 => PI - 1e-4..=PI, 1 => -PI..=-PI + 1e-4]
}

fn bev(around: Pose, reach_m: f64) -> impl Strategy<Value = BevBox> {
    let offset = -reach_m..reach_m;
    (offset.clone(), offset, 0.001..65.0, 0.001..65.0, heading()).prop_map(move |(x, y, w, d, yaw)| BevBox {
        x: around.x + x,
        y: around.y + y,
        w,
        d,
        yaw,
    })
}

fn box_covariance() -> impl Strategy<Value = BoxCovariance> {
    (covariance2(), sigma_m(), sigma_m(), sigma_rad()).prop_map(|(position, sw, sd, st)| BoxCovariance {
        position,
        ww: sw * sw,
        dd: sd * sd,
        yaw: st * st,
    })
}

fn covariance2() -> impl Strategy<Value = Covariance2> {
    (sigma_m(), sigma_m(), -0.9999..0.9999).prop_map(|(x, y, rho)| Covariance2 {
        xx: x * x,
        xy: rho * x * y,
        yy: y * y,
    })
}

/// From the smallest step of the wire to the limit of validation, evenly in the logarithm.
fn sigma_m() -> impl Strategy<Value = f64> {
    (libm::log(1e-3)..=libm::log(70.0)).prop_map(|log| libm::exp(log).clamp(1e-3, 70.0))
}

fn sigma_rad() -> impl Strategy<Value = f64> {
    sigma_m().prop_map(|sigma| sigma / 10.0)
}

//! Bytes on the wire: a frame of 20 detections fits 512, as in the paper (2⁹), with velocities 700.

use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, MapFrame};
use v2x_common::time::Timestamp;
use v2x_common::wire::detections;

const N_DETECTIONS: u8 = 20;
const BUDGET_BYTES: usize = 512;
const BUDGET_WITH_VELOCITY_BYTES: usize = 700;

#[derive(Clone, Copy)]
enum Place {
    Local,
    Utm,
}

/// Boot epoch in µs, time in ns, ten hours of frames at 10 Hz behind it.
fn empty(place: Place) -> DetectionFrame {
    let (x, y) = match place {
        Place::Local => (12.5, -3.25),
        Place::Utm => (500_000.123, 5_400_000.456),
    };
    let map_frame = match place {
        Place::Local => None,
        Place::Utm => Some(MapFrame::new("EPSG:32632").unwrap()),
    };
    DetectionFrame {
        id: FrameId {
            agent: AgentId::new("rsu-north-12").unwrap(),
            epoch: 1_789_998_400_123_456,
            sequence: 360_000,
        },
        captured_at: Timestamp::from_nanos(1_789_998_400_123_456_789),
        sensor_pose: Some(Pose { x, y, yaw: 1.2 }),
        sensor_revision: 1,
        map_frame,
        detections: Vec::new(),
    }
}

fn bytes_of(place: Place, detection: impl Fn(u8) -> Detection) -> usize {
    let mut frame = empty(place);
    let pose = frame.sensor_pose.unwrap();
    frame.detections = (0..N_DETECTIONS).map(detection).collect();
    for detection in &mut frame.detections {
        detection.bev.x += pose.x;
        detection.bev.y += pose.y;
    }
    let mut bytes = Vec::new();
    detections::encode(&frame, &mut bytes).unwrap();
    bytes.len()
}

/// Cars on a spiral of golden angles around the sensor, evenly over the disc of 60 m, every third one driving.
fn spread(i: u8) -> Detection {
    let (i, n) = (f64::from(i), f64::from(N_DETECTIONS));
    let (range, bearing) = (60.0 * libm::sqrt((i + 0.5) / n), 2.399_963 * i);
    let sigma = 0.05 + 0.01 * range;
    Detection {
        class: Class::Car,
        score: 0.9,
        bev: BevBox {
            x: range * libm::cos(bearing),
            y: range * libm::sin(bearing),
            w: 1.8 + 0.01 * i,
            d: 4.5 + 0.02 * i,
            yaw: (0.7 * i) % 3.0 - 1.5,
        },
        covariance: BoxCovariance {
            position: Covariance2 { xx: sigma * sigma, xy: 0.3 * sigma * sigma, yy: sigma * sigma },
            ww: 0.03,
            dd: 0.2,
            yaw: 0.01,
        },
        velocity: None,
        heading: v2x_common::detection::HeadingKind::Known,
        source_track: None,
    }
}

/// Every number as long as it gets within 60 m, 60 m/s and 16.3 m of size.
fn longest(_: u8) -> Detection {
    let mut detection = spread(0);
    detection.bev = BevBox { x: -60.0, y: 60.0, w: 16.3, d: 16.3, yaw: -3.1 };
    detection
}

fn driving(mut detection: Detection) -> Detection {
    let x = if detection.bev.w > 10.0 { -60.0 } else { 13.889 };
    detection.velocity = Some(Velocity { x, y: -x, covariance: Covariance2::isotropic(0.3) });
    detection
}

#[test]
fn twenty_detections_fit_512_bytes_and_700_with_velocities() {
    for place in [Place::Local, Place::Utm] {
        assert!(bytes_of(place, longest) <= BUDGET_BYTES);
        assert!(bytes_of(place, |i| driving(longest(i))) <= BUDGET_WITH_VELOCITY_BYTES);
    }
}

/// The figures that the documentation may quote.
#[test]
fn sizes_are_as_documented() {
    let sizes = |detection: fn(u8) -> Detection| {
        [Place::Local, Place::Utm]
            .map(|place| [bytes_of(place, detection), bytes_of(place, |i| driving(detection(i)))])
    };
    assert_eq!(sizes(spread), [[467, 647], [483, 663]], "cars over the disc");
    assert_eq!(sizes(longest), [[486, 666], [502, 682]], "the longest numbers");
}

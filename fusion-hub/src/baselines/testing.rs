//! Reports for the tests of the rules.

use super::report::Report;
use crate::values::Measurement;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;

/// A car of 2 m × 4 m heading east, with σ 0.5 m, 20 % and 0.1 rad.
pub(super) fn report(x: f64, y: f64) -> Report {
    Report {
        z: Measurement {
            class: Class::Car,
            position: [x, y],
            r: Covariance2::isotropic(0.5),
            size: [2.0, 4.0],
            relative_variance: [0.04; 2],
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            yaw: 0.0,
            yaw_variance: 0.01,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        },
        score: 1.0,
    }
}

pub(super) fn of_class(report: Report, class: Class) -> Report {
    Report { z: Measurement { class, ..report.z }, ..report }
}

pub(super) fn scored(report: Report, score: f64) -> Report {
    Report { score, ..report }
}

pub(super) fn sized(report: Report, size: [f64; 2], yaw: f64) -> Report {
    Report { z: Measurement { size, yaw, ..report.z }, ..report }
}

pub(super) fn close(ours: f64, expected: f64) -> bool {
    (ours - expected).abs() < 1e-12
}

//! A frame as its agent would have sent it with true clock and pose.

use super::model::Bias;
use v2x_common::covariance::Covariance2;
use v2x_common::detection::DetectionFrame;
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::time::Span;

/// Corrects a frame by a clock and pose error: it is turned about the sensor, then shifted, and its stamp is
/// moved. Agent, epoch and sequence stay. `None` without a sensor pose to turn about.
///
/// `into` is overwritten, its memory is used again.
pub fn correct(frame: &DetectionFrame, bias: &Bias, into: &mut DetectionFrame) -> Option<()> {
    let pose = frame.sensor_pose?;
    let DetectionFrame { id, captured_at, sensor_revision, map_frame, .. } = *frame;
    let (sin, cos) = libm::sincos(-bias.yaw_rad);
    let turned = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
    let turned_covariance = |c: &Covariance2| Covariance2 {
        xx: cos * cos * c.xx - 2.0 * sin * cos * c.xy + sin * sin * c.yy,
        xy: sin * cos * (c.xx - c.yy) + (cos * cos - sin * sin) * c.xy,
        yy: sin * sin * c.xx + 2.0 * sin * cos * c.xy + cos * cos * c.yy,
    };
    into.id = id;
    into.captured_at = captured_at - Span::from_secs_f64(bias.clock_s);
    into.sensor_revision = sensor_revision;
    into.map_frame = map_frame;
    into.sensor_pose =
        Some(Pose { x: pose.x - bias.dx_m, y: pose.y - bias.dy_m, yaw: wrap_angle(pose.yaw - bias.yaw_rad) });
    into.detections.clear();
    into.detections.extend_from_slice(&frame.detections);
    for detection in &mut into.detections {
        let [x, y] = turned([detection.bev.x - pose.x, detection.bev.y - pose.y]);
        detection.bev.x = pose.x + x - bias.dx_m;
        detection.bev.y = pose.y + y - bias.dy_m;
        detection.bev.yaw = wrap_angle(detection.bev.yaw - bias.yaw_rad);
        detection.covariance.position = turned_covariance(&detection.covariance.position);
        if let Some(velocity) = &mut detection.velocity {
            [velocity.x, velocity.y] = turned([velocity.x, velocity.y]);
            velocity.covariance = turned_covariance(&velocity.covariance);
        }
    }
    Some(())
}

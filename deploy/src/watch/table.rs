//! The live table of fused objects.

use std::fmt::Write;
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::time::Timestamp;

/// Rows that are shown; of more objects those with the highest existence probability.
const MAX_ROWS: usize = 40;

/// The frame as a table, as of `now` by the consumer's clock.
pub(super) fn table(frame: &FusedFrame, now: Timestamp) -> String {
    let newest = frame.agents.iter().map(|health| health.newest_captured_at).max().unwrap_or(frame.fused_at);
    let mut text = format!(
        "{} · {} objects · frame {} · {:.0} ms since the newest measurement\n",
        frame.hub,
        frame.objects.len(),
        frame.sequence,
        (now - newest).as_millis_f64(),
    );
    for health in &frame.agents {
        let _ = writeln!(
            text,
            "  {}: {} frames accepted, {} of them late; {} refused",
            health.agent, health.accepted, health.out_of_sequence, health.refused
        );
    }
    let _ = writeln!(
        text,
        "\n{:<14} {:<26} {:>8} {:>8} {:>6} {:>6} {:>7} {:>11} {:>6} {:>6}  agents",
        "track", "class", "x m", "y m", "± m", "m/s", "yaw °", "w × d m", "exist", "age s"
    );
    let mut objects: Vec<_> = frame.objects.iter().collect();
    if objects.len() > MAX_ROWS {
        objects.sort_by(|a, b| b.existence.total_cmp(&a.existence).then(a.track.cmp(&b.track)));
    }
    for object in objects.iter().take(MAX_ROWS) {
        text.push_str(&row(object));
    }
    if objects.len() > MAX_ROWS {
        let _ = writeln!(text, "… and {} more", objects.len() - MAX_ROWS);
    }
    text
}

fn row(object: &FusedObject) -> String {
    let FusedObject { bev, velocity: (vx, vy), kinematic_covariance: covariance, .. } = object;
    let sigma = ((covariance[0] + covariance[4]) / 2.0).sqrt();
    let speed = (vx * vx + vy * vy).sqrt();
    let agents: Vec<_> =
        object.contributors.iter().map(|measurement| measurement.frame.agent.to_string()).collect();
    format!(
        "{:<14} {:<26} {:>8.2} {:>8.2} {:>6.2} {:>6.1} {:>7.1} {:>11} {:>6.3} {:>6.1}  {}\n",
        object.track.to_string(),
        object.class,
        bev.x,
        bev.y,
        sigma,
        speed,
        bev.yaw.to_degrees(),
        format!("{:.2} × {:.2}", bev.w, bev.d),
        object.existence,
        object.age.as_secs_f64(),
        agents.join(" "),
    )
}

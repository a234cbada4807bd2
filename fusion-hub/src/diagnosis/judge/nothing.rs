//! Nothing is fused, though agents report what lasts.

use super::super::finding::{Code, Finding};
use super::super::window::Window;
use v2x_common::id::AgentId;

/// Objects that an agent reports in one frame after the other, in the mean of its frames, from which on one should be published.
const MIN_LASTING: f64 = 1.0;
/// Fewest lists that show it: some seconds at the slowest usual rate.
const MIN_LISTS: u64 = 20;
/// Agents that are named.
const MOST_NAMED: usize = 8;

/// The finding of a window in which no list had an object.
pub(super) fn finding(window: &Window) -> Option<Finding> {
    if !window.is_over || window.lists < MIN_LISTS || window.lists_with_objects > 0 {
        return None;
    }
    let agents = window.agents.iter().filter(|(_, survey)| survey.refused.is_empty());
    let lasting = agents.map(|(agent, _)| (*agent, window.snapshots.lasting(agent)));
    let lasting: Vec<(AgentId, f64)> = lasting.filter(|(_, n)| *n >= MIN_LASTING).collect();
    if lasting.is_empty() {
        return None;
    }
    let named: Vec<_> =
        lasting.iter().take(MOST_NAMED).map(|(agent, n)| format!("{agent} some {n:.0}")).collect();
    let more = if lasting.len() > MOST_NAMED { ", …" } else { "" };
    let says = format!(
        "no object is published in {} lists, though agents report objects that last from frame to frame ({}{more})",
        window.lists,
        named.join(", ")
    );
    let change = match lasting.len() {
        1 => {
            "Do its scores, its `detection_probability` or `publish_existence` keep them below what is published?"
        }
        _ => {
            "Each of several agents denies what only another one reports in its view: correct what is said of their places, axes and \
             clocks, or state their fields of view (`sensor`) where they see different places"
        }
    };
    Some(Finding::of_network(Code::NothingFused, says, change))
}

#[cfg(test)]
mod tests {
    use super::super::super::headings::Moving;
    use super::super::super::observation::Observation;
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::{BoxCovariance, Covariance2};
    use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
    use v2x_common::geometry::BevBox;
    use v2x_common::id::FrameId;
    use v2x_common::time::{Span, Timestamp};

    fn car(x: f64, y: f64) -> Detection {
        let covariance = BoxCovariance { position: Covariance2::isotropic(0.04), ww: 0.1, dd: 0.1, yaw: 0.1 };
        let bev = BevBox { x, y, w: 1.8, d: 4.5, yaw: 0.0 };
        let (class, heading) = (Class::Car, HeadingKind::Known);
        Detection { class, score: 1.0, bev, covariance, velocity: None, heading, source_track: None }
    }

    /// Of an agent that reports these at each time (s), and lists of which so many have objects.
    fn of(seen: impl Fn(f64) -> Vec<Detection>, lists_with_objects: u64) -> Option<Finding> {
        let agent = AgentId::new("cam").unwrap();
        let mut window = Window { is_over: true, lists: 100, lists_with_objects, ..Window::default() };
        window.agent(agent).unwrap();
        for k in 0..24_u32 {
            let t = 0.4 * f64::from(k);
            let at = Timestamp::EPOCH + Span::from_secs_f64(1_000_000.0 + t);
            let id = FrameId { agent, epoch: 1, sequence: u64::from(k) };
            let frame = DetectionFrame { detections: seen(t), ..DetectionFrame::empty(id, at) };
            let seen = Observation { frame: &frame, reported: &Default::default(), received_at: at };
            window.snapshots.note(&seen, &Moving::default());
        }
        finding(&window)
    }

    #[test]
    fn lists_without_an_object_are_a_fault_where_an_agent_reports_what_lasts() {
        let cars = |t: f64| vec![car(9.0 * t - 40.0, 2.0), car(20.0, -8.0)];
        let found = of(cars, 0).unwrap();
        assert!(found.is_fault() && found.says.contains("cam some 2"), "{found}");
        assert_eq!(of(cars, 1), None, "an object was there");
    }

    #[test]
    fn lists_without_an_object_are_right_where_nothing_is_seen_or_only_clutter() {
        assert_eq!(of(|_| Vec::new(), 0), None);
        // Three a frame, each time elsewhere.
        let clutter = |t: f64| {
            let place =
                |n: f64| car(80.0 * libm::sin(37.0 * t + 11.0 * n), 80.0 * libm::cos(53.0 * t + 7.0 * n));
            vec![place(0.0), place(1.0), place(2.0)]
        };
        assert_eq!(of(clutter, 0), None);
    }
}

//! One time of a run: true objects, every agent's detections and the fused objects.

use crate::data::run_log::{ReceivedDetections, RunLog};
use crate::data::truth::Truth;
use crate::score::coverage::Coverage;
use crate::score::run::scored_run::ScoredRun;
use v2x_agent::world::Road;
use v2x_common::class::Class;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorKind;
use v2x_common::time::{Span, Timestamp};

/// The contents of a bird's-eye view, in the map frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BevScene {
    /// Title.
    pub title: String,
    /// Subtitle.
    pub subtitle: String,
    /// Lines on the ground, surfaces first.
    pub roads: Vec<Road>,
    /// True objects.
    pub truth: Vec<TrueBox>,
    /// Agents with their detections.
    pub agents: Vec<SceneAgent>,
    /// Fused objects.
    pub fused: Vec<BevBox>,
    /// Those that move: where they are, and will be in a second.
    pub motions: Vec<[(f64, f64); 2]>,
    /// The letter of each fused object's class: C car, P pedestrian, and so on.
    pub letters: Vec<((f64, f64), String)>,
}

/// A true object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrueBox {
    /// Its box.
    pub bev: BevBox,
    /// Whether any agent covers it.
    pub is_covered: bool,
}

/// An agent with its detections.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SceneAgent {
    /// Which agent.
    pub id: AgentId,
    /// The kind of its sensor.
    pub kind: SensorKind,
    /// Pose of its sensor.
    pub pose: Option<Pose>,
    /// Its detections in the frame that was captured nearest to the time.
    pub detections: Vec<BevBox>,
    /// From the time to that frame's capture; negative where it was earlier.
    pub offset: Option<Span>,
}

/// Which moment of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moment {
    /// The scored fused frame with the median error.
    Typical,
    /// The one with the largest error.
    Worst,
}

impl Moment {
    /// Its place in the log; `None` where no fused frame has an error.
    fn place(self, scored: &ScoredRun) -> Option<usize> {
        match self {
            Self::Typical => scored.median_frame(),
            Self::Worst => {
                scored.frame_errors.iter().max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(place, _)| *place)
            }
        }
    }

    const fn in_words(self) -> (&'static str, &'static str) {
        match self {
            Self::Typical => ("a typical moment", "the median of all scored fused frames"),
            Self::Worst => ("the worst moment", "the largest of all scored fused frames"),
        }
    }
}

/// Speed from which an object has an arrow, m/s.
const MOVING_MPS: f64 = 0.5;

/// The scene of a moment; `None` where no fused frame has an error.
pub(crate) fn scene_at(
    moment: Moment,
    scored: &ScoredRun,
    log: &RunLog,
    truth: Truth<'_>,
) -> Option<BevScene> {
    let place = moment.place(scored)?;
    let (what, rank) = moment.in_words();
    let frame = &log.fused.get(place)?.frame;
    let error_m = scored.frame_errors.iter().find(|(of, _)| *of == place).map(|(_, ate_m)| *ate_m)?;
    let summary = &scored.summary;
    let mut coverage = Coverage::new(truth, &scored.observers);
    let view = coverage.at(frame.fused_at);
    let true_box = |object: &v2x_agent::truth::TrueObject| TrueBox {
        bev: object.bev,
        is_covered: coverage.is_covered(&view, object.id),
    };
    let agents = summary.agents.iter().zip(&view.poses).map(|(agent, pose)| {
        let nearest = nearest_frame(log, agent.id, frame.fused_at);
        SceneAgent {
            id: agent.id,
            kind: agent.kind,
            pose: *pose,
            detections: nearest.map_or_else(Vec::new, |r| r.frame.detections.iter().map(|d| d.bev).collect()),
            offset: nearest.map(|received| received.frame.captured_at - frame.fused_at),
        }
    });
    Some(BevScene {
        title: format!("{}, seed {}: {what}", summary.scenario, summary.seed),
        subtitle: format!("mean fused position error {error_m:.2} m, {rank}"),
        roads: Vec::new(),
        truth: view.objects.iter().map(true_box).collect(),
        agents: agents.collect(),
        fused: frame.objects.iter().map(|object| object.bev).collect(),
        motions: frame.objects.iter().filter_map(motion).collect(),
        letters: frame
            .objects
            .iter()
            .map(|object| ((object.bev.x, object.bev.y), letter(object.class)))
            .collect(),
    })
}

fn motion(object: &FusedObject) -> Option<[(f64, f64); 2]> {
    let (BevBox { x, y, .. }, (vx, vy)) = (object.bev, object.velocity);
    (libm::hypot(vx, vy) > MOVING_MPS).then_some([(x, y), (x + vx, y + vy)])
}

/// The first letter of the last part of a class's name, or of its group for people.
fn letter(class: Class) -> String {
    let name = class.to_string();
    let part = if name.starts_with("human.") { "pedestrian" } else { name.rsplit('.').next().unwrap_or("") };
    part.chars().take(1).flat_map(char::to_uppercase).collect()
}

fn nearest_frame(log: &RunLog, agent: AgentId, at: Timestamp) -> Option<&ReceivedDetections> {
    let frames = log.detections.iter().filter(|received| received.frame.id.agent == agent);
    frames.min_by_key(|received| (received.frame.captured_at - at).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::run::test_run::{pose, run, scored, world};

    #[test]
    fn the_median_frame_shows_truth_fused_objects_and_the_nearest_frame_of_each_agent() {
        let (mut log, facts) = run();
        // 23 ms after its neighbours' capture; the agents' frame before it is nearer than the one after.
        log.fused.iter_mut().for_each(|received| received.frame.fused_at += Span::from_millis(23));
        let scored = scored(&log, &facts).unwrap();
        let truth = Truth { objects_at: &world, agent_pose: &pose };
        let scene = scene_at(Moment::Typical, &scored, &log, truth).unwrap();
        assert_eq!(
            scene.truth.iter().map(|truth| truth.is_covered).collect::<Vec<_>>(),
            [true, true, true, false]
        );
        assert_eq!(scene.agents.iter().map(|agent| agent.detections.len()).collect::<Vec<_>>(), [4, 2]);
        assert!(scene.agents.iter().all(|agent| agent.offset == Some(Span::from_millis(-23))));
        assert!(scene.fused.len() >= 4 && scene.subtitle.contains("0.10 m"), "{}", scene.subtitle);
    }
}

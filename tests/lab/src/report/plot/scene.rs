//! One time of a run: true objects, every agent's detections and the fused objects.

use crate::data::run_log::{ReceivedDetections, RunLog};
use crate::data::truth::Truth;
use crate::score::coverage::Coverage;
use crate::score::run::scored_run::ScoredRun;
use v2x_agent::truth::TrueObject;
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
    pub fused: Vec<FusedMark>,
    /// Those that move: where they are, and will be in a second.
    pub motions: Vec<[(f64, f64); 2]>,
    /// What is shown enlarged; where it is not said, the densest region.
    pub focus: Option<Focus>,
}

/// What is shown enlarged.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Focus {
    /// Its place, m.
    pub at: (f64, f64),
    /// What it is.
    pub words: String,
}

/// A true object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrueBox {
    /// Its box.
    pub bev: BevBox,
    /// Its class.
    pub class: Class,
    /// Whether any agent covers it.
    pub is_covered: bool,
}

/// A fused object.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FusedMark {
    /// Its box.
    pub bev: BevBox,
    /// Its class.
    pub class: Class,
    /// What else is known of it, in words.
    pub words: String,
}

/// An agent with its detections.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SceneAgent {
    /// Which agent.
    pub id: AgentId,
    /// The kind of its sensor, where it is known.
    pub kind: Option<SensorKind>,
    /// Pose of its sensor.
    pub pose: Option<Pose>,
    /// Its detections in the frame that was captured nearest to the time.
    pub detections: Vec<BevBox>,
    /// From the time to that frame's capture; negative where it was earlier.
    pub offset: Option<Span>,
}

impl SceneAgent {
    /// The kind whose mark it has: one that does not move says nothing of a heading.
    pub(crate) fn marked_as(&self) -> SensorKind {
        self.kind.unwrap_or(SensorKind::RoadsideUnit)
    }
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
            Self::Typical => ("a typical moment", "the median of all fused frames"),
            Self::Worst => ("the worst moment", "the largest of all fused frames"),
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
    let radius_m = summary.match_radius_m;
    let mut coverage = Coverage::new(truth, &scored.observers);
    let view = coverage.at(frame.fused_at);
    let true_box = |object: &TrueObject| TrueBox {
        bev: object.bev,
        class: object.class,
        is_covered: coverage.is_covered(&view, object.id),
    };
    let agents = summary.agents.iter().zip(&view.poses).map(|(agent, pose)| {
        let nearest = nearest_frame(log, agent.id, frame.fused_at);
        SceneAgent {
            id: agent.id,
            kind: Some(agent.kind),
            pose: *pose,
            detections: nearest.map_or_else(Vec::new, |r| r.frame.detections.iter().map(|d| d.bev).collect()),
            offset: nearest.map(|received| received.frame.captured_at - frame.fused_at),
        }
    });
    Some(BevScene {
        title: format!("{}, seed {}: {what}", summary.scenario, summary.seed),
        subtitle: format!("mean position error {error_m:.2} m of all that is covered, {rank}"),
        roads: Vec::new(),
        truth: view.objects.iter().map(true_box).collect(),
        agents: agents.collect(),
        fused: frame
            .objects
            .iter()
            .map(|object| fused_mark(object, Some((&view.objects, radius_m))))
            .collect(),
        motions: frame.objects.iter().filter_map(motion).collect(),
        focus: (moment == Moment::Worst)
            .then(|| largest_error(&frame.objects, &view.objects, radius_m))
            .flatten(),
    })
}

/// The fused object that is farthest from its nearest true object, of those that have one in reach.
fn largest_error(fused: &[FusedObject], truth: &[TrueObject], reach_m: f64) -> Option<Focus> {
    let errors = fused.iter().filter_map(|object| {
        let distances = truth.iter().map(|one| distance_m(&object.bev, &one.bev));
        let nearest_m = distances.filter(|distance_m| *distance_m <= reach_m).min_by(f64::total_cmp)?;
        Some((nearest_m, object))
    });
    let (error_m, object) = errors.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let words = format!("the dashed square, enlarged: the largest error, {} by {error_m:.2} m", object.class);
    Some(Focus { at: (object.bev.x, object.bev.y), words })
}

fn distance_m(a: &BevBox, b: &BevBox) -> f64 {
    libm::hypot(a.x - b.x, a.y - b.y)
}

/// With speed, standard deviation of its position, and, where the truth is known, how far the nearest true object is, if there is
/// one in reach.
pub(super) fn fused_mark(object: &FusedObject, truth: Option<(&[TrueObject], f64)>) -> FusedMark {
    let FusedObject { bev, class, velocity: (vx, vy), kinematic_covariance, .. } = object;
    let [xx, _, _, _, yy, ..] = *kinematic_covariance;
    let mut words = format!(
        "{class}, {:.1} m/s, σ {:.2} m a coordinate",
        libm::hypot(*vx, *vy),
        libm::sqrt(f64::midpoint(xx, yy))
    );
    let Some((truth, reach_m)) = truth else { return FusedMark { bev: *bev, class: *class, words } };
    let distances = truth.iter().map(|one| distance_m(&one.bev, bev));
    let nearest_m = distances.filter(|distance_m| *distance_m <= reach_m).min_by(f64::total_cmp);
    words += &nearest_m.map_or_else(
        || format!("; no true object within {reach_m:.1} m"),
        |distance_m| format!("; {distance_m:.2} m from the nearest true object"),
    );
    FusedMark { bev: *bev, class: *class, words }
}

/// Where a moving object is, and where it will be in a second.
pub(super) fn motion(object: &FusedObject) -> Option<[(f64, f64); 2]> {
    let (BevBox { x, y, .. }, (vx, vy)) = (object.bev, object.velocity);
    (libm::hypot(vx, vy) > MOVING_MPS).then_some([(x, y), (x + vx, y + vy)])
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
        let words: Vec<&str> = scene.fused.iter().map(|mark| mark.words.as_str()).collect();
        assert_eq!(
            words[1],
            "vehicle.car, 0.0 m/s, σ 0.14 m a coordinate; 0.10 m from the nearest true object"
        );
        assert_eq!(scene.focus, None);
        let worst = scene_at(Moment::Worst, &scored, &log, truth).unwrap();
        let words = worst.focus.map_or_else(String::new, |focus| focus.words);
        assert!(words.contains("enlarged: the largest error, vehicle.car by "), "{words}");
        assert!(scene.fused.len() >= 4 && scene.subtitle.contains("0.10 m"), "{}", scene.subtitle);
    }
}

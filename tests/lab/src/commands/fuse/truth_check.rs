//! Whether the truth is of the same world as the detections, in the same units: it is held against them as the frames of one more
//! sensor would be. A score by a truth that is mirrored, late or in degrees says nothing of what was fused.

use crate::data::truth_table::{Moment, Truth};
use crate::score::offline::Region;
use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::reported::Reported;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::diagnosis::{Code, Finding, Observation, Surroundings, Survey};

/// The ground truth, and where it is complete.
pub(super) type Known = (Truth, Option<Region>);

/// The truth's name among the sensors.
const NAME: &str = "truth";
/// Variances that are assumed of it: m², m², rad².
const POSITION: f64 = 0.04;
const SIZE: f64 = 0.04;
const YAW: f64 = 0.003;
const VELOCITY: f64 = 0.25;
/// What can be said of a table that no sensor sends.
const OF_TRUTH: [Code; 12] = [
    Code::Degrees,
    Code::HeadingsMirrored,
    Code::HeadingsRotated,
    Code::HeadingsReversed,
    Code::SizesSwapped,
    Code::Velocities,
    Code::Geodetic,
    Code::SensorFrame,
    Code::Axes,
    Code::LengthUnit,
    Code::Offset,
    Code::FarAway,
];
const CORRECT: &str = "Write the table of --truth in metres (x east, y north, as the detections), radians counter-clockwise from east, \
                       m/s, w across the heading and d along it, and seconds of the same clock: a score by another one says nothing";

/// What looks wrong with the log, and with its truth.
#[derive(Debug)]
pub(super) struct Diagnoses {
    pub(super) log: Survey,
    truth: Option<TruthCheck>,
}

#[derive(Debug)]
struct TruthCheck {
    truth: Truth,
    name: AgentId,
    survey: Survey,
    last: Timestamp,
    sequence: u64,
}

impl Diagnoses {
    /// Of a log, with its truth where that is known.
    pub(super) fn new(truth: Option<&Known>) -> Self {
        let check = |(truth, _): &Known| {
            Some(TruthCheck {
                truth: truth.clone(),
                name: AgentId::new(NAME).ok()?,
                survey: Survey::default(),
                last: Timestamp::MIN,
                sequence: 0,
            })
        };
        Self { log: Survey::default(), truth: truth.and_then(check) }
    }

    pub(super) fn note_frame(&mut self, seen: &Observation<'_>) {
        self.log.note_frame(seen);
        if let Some(check) = self.truth.as_mut().filter(|check| check.name != seen.frame.id.agent) {
            check.note_truth(seen.frame.captured_at);
            check.survey.note_frame(seen);
        }
    }

    pub(super) fn note_list(&mut self, list: &FusedFrame) {
        self.log.note_list(list);
        if let Some(check) = &mut self.truth {
            check.survey.note_list(list);
        }
    }

    /// What is found of the log, and of its truth.
    pub(super) fn conclude(mut self, around: &Surroundings<'_>) -> (Vec<Finding>, Vec<Finding>) {
        self.log.conclude(around);
        let of_truth = self.truth.map(|check| check.conclude(around)).unwrap_or_default();
        (self.log.findings().to_vec(), of_truth)
    }
}

impl TruthCheck {
    /// The truth of the time of a frame, where none was taken of it before.
    fn note_truth(&mut self, at: Timestamp) {
        let (begin, end) = self.truth.span();
        if at <= self.last || at < begin || at > end {
            return;
        }
        self.last = at;
        self.sequence += 1;
        let id = FrameId { agent: self.name, epoch: 1, sequence: self.sequence };
        let frame =
            DetectionFrame { detections: detections(&self.truth.at(at)), ..DetectionFrame::empty(id, at) };
        let reported = Reported { has_sequence: true, ..Reported::default() };
        self.survey.note_frame(&Observation { frame: &frame, reported: &reported, received_at: at });
    }

    fn conclude(mut self, around: &Surroundings<'_>) -> Vec<Finding> {
        if let Some(largest) = self.truth.degrees() {
            let says = format!("its headings (yaw, up to {largest:.0}) are degrees, and are read as radians");
            return vec![Finding {
                agent: Some(self.name),
                ..Finding::of_network(Code::Degrees, says, CORRECT)
            }];
        }
        self.survey.conclude(around);
        let findings =
            self.survey.findings().iter().filter(|one| one.is_fault() && OF_TRUTH.contains(&one.code));
        let concerns = |one: &&Finding| one.agent == Some(self.name) || one.says.contains(NAME);
        findings.filter(concerns).map(|one| Finding { change: CORRECT.to_owned(), ..one.clone() }).collect()
    }
}

fn detections(moment: &Moment) -> Vec<Detection> {
    let of = |(object, velocity): (&v2x_agent::truth::TrueObject, &Option<(f64, f64)>)| Detection {
        class: object.class,
        score: 1.0,
        bev: object.bev,
        covariance: BoxCovariance {
            position: Covariance2::isotropic(POSITION),
            ww: SIZE,
            dd: SIZE,
            yaw: YAW,
        },
        velocity: velocity.map(|(x, y)| Velocity { x, y, covariance: Covariance2::isotropic(VELOCITY) }),
        heading: HeadingKind::Known,
        source_track: None,
    };
    moment.objects.iter().zip(&moment.velocities).map(of).collect()
}

//! First stage: the tracks that a frame can concern, predicted to its capture time.

use super::config::{Lifetimes, TrackerConfig};
use super::store::TrackStore;
use super::whereabouts::Whereabouts;
use crate::filter::{Due, Filter};
use crate::track::{FrameSlot, PastReader, Snapshot, StoredFrame, Track, TrackContext};
use crate::values::{Coast, Coverage, ExpectedPlace, Measurement, PredictedMeasurement, SharedError};
use v2x_common::class::Class;
use v2x_common::time::{Span, Timestamp};

/// An object that a frame can detect or miss is at most this far outside of the frame's region, m.
const REGION_MARGIN_M: f64 = 20.0;
/// And for each second between the track's state and the frame, this much further, m/s.
const REGION_SPEED_MPS: f64 = 60.0;
/// And this many standard deviations of the track's and of the measurements' positions.
const REGION_SIGMAS: f64 = 10.0;

/// A stored frame with its measurements, without velocities.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameView<'a> {
    pub(crate) slot: FrameSlot,
    pub(crate) stored: &'a StoredFrame,
    pub(crate) measurements: &'a [Measurement],
}

/// Predicted tracks, and their predicted measurements. A track is named by its place here.
#[derive(Debug)]
pub(crate) struct Predictions<F> {
    tracks: Vec<usize>,
    states: Vec<F>,
    measurements: Vec<PredictedMeasurement>,
    /// States that are still to be predicted.
    due: Vec<Due>,
    /// What else is known of the tracks, until they are predicted.
    estimates: Vec<Known>,
    concerned: Concerned<F>,
}

/// The tracks that a frame can concern. The memory is used again.
#[derive(Debug)]
struct Concerned<F> {
    /// Indices in the track store.
    all: Vec<usize>,
    /// Of these, tracks that know of later times than the frame's.
    later: Vec<usize>,
    past: PastReader<F>,
}

/// What is known of a track beside its state.
#[derive(Clone, Copy, Debug)]
struct Known {
    class: Class,
    /// Probability that it exists at the time of the frame.
    existence: f64,
    shared_error: SharedError,
    by_positions: Option<ExpectedPlace>,
}

impl<F> Default for Predictions<F> {
    fn default() -> Self {
        Self {
            tracks: Vec::new(),
            states: Vec::new(),
            measurements: Vec::new(),
            due: Vec::new(),
            estimates: Vec::new(),
            concerned: Concerned::default(),
        }
    }
}

impl<F> Default for Concerned<F> {
    fn default() -> Self {
        Self { all: Vec::new(), later: Vec::new(), past: PastReader::default() }
    }
}

/// Which tracks are predicted at all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PredictionLimits {
    /// A track is not predicted over more than this. It is the time for which a track is kept, so that late data can
    /// bridge a gap.
    memory: Span,
    /// Without a lag, tracks detected since then are kept, and for the time of coasting. With a lag, older ones are kept
    /// for publishing only, and are not predicted; `None` without a lag.
    detected_from: Option<Timestamp>,
    coast: Coast,
}

impl PredictionLimits {
    /// `detected_from` is since when tracks must have been detected to be kept without a lag, but for coasting.
    pub(crate) fn new(config: &TrackerConfig, lifetimes: &Lifetimes, detected_from: Timestamp) -> Self {
        let has_lag = config.hypotheses.longest_lag() > Span::ZERO;
        Self {
            memory: lifetimes.coast.longest() + lifetimes.delta_max,
            detected_from: has_lag.then_some(detected_from),
            coast: lifetimes.coast,
        }
    }
}

impl PredictionLimits {
    /// Whether a track is kept for publishing only.
    fn leave_out<F: Filter>(&self, track: &Track<F>) -> bool {
        let coast = || self.coast.remembered(track.latest().interval_s);
        self.detected_from.is_some_and(|from| track.last_measured_at() < from - coast())
    }
}

impl<F: Filter> Concerned<F> {
    fn begin(&mut self) {
        self.all.clear();
        self.later.clear();
    }

    fn add(&mut self, index: usize, knows_later: bool) {
        self.all.push(index);
        self.later.extend(knows_later.then_some(index));
    }

    /// Calls `take` with the index of each and its estimate by the evidence up to a time.
    fn estimates(
        &mut self,
        tracks: &[Track<F>],
        at: Timestamp,
        context: &TrackContext<'_>,
        mut take: impl FnMut(usize, &Snapshot<F>),
    ) {
        let Self { all, later, past } = self;
        let mut later = later.iter().zip(past.read(tracks, (later, at), context)).peekable();
        for index in all {
            let past = later.next_if(|(known, _)| *known == index).map(|(_, estimate)| estimate);
            take(*index, past.unwrap_or_else(|| tracks[*index].latest()));
        }
    }
}

impl<F: Filter> Predictions<F> {
    /// Predicts the tracks that a frame can concern to its capture time.
    pub(crate) fn predict(
        &mut self,
        tracks: &mut TrackStore<F>,
        frame: &FrameView<'_>,
        limits: &PredictionLimits,
        context: &TrackContext<'_>,
    ) {
        self.clear();
        let at = frame.stored.captured_at;
        let Some(region) = Region::of(frame) else { return };
        let (tracks, whereabouts) = tracks.with_whereabouts();
        let mut concerned = std::mem::take(&mut self.concerned);
        concerned.begin();
        for (index, whereabouts) in whereabouts.iter().enumerate() {
            if !whereabouts.concerns_all && !region.may_hold(whereabouts, at) {
                continue;
            }
            let track = &tracks[index];
            if !limits.leave_out(track) {
                concerned.add(index, !track.is_newest(at));
            }
        }
        concerned.estimates(tracks, at, context, |index, estimate| {
            self.take_in((index, &tracks[index], estimate), at, limits, context);
        });
        self.concerned = concerned;
        // All at once: several of them fit into one instruction.
        F::predict_some(&mut self.states, &self.due);
        let Self { states, measurements, estimates, .. } = self;
        F::predicted_measurements(
            states,
            |place| estimates[place].class,
            |predicted| measurements.push(predicted),
        );
        for (predicted, known) in measurements.iter_mut().zip(estimates) {
            known.complete(predicted, frame.stored);
        }
    }

    /// Takes in a track with its estimate by the evidence up to a time, to be predicted to that.
    fn take_in(
        &mut self,
        (index, track, estimate): (usize, &Track<F>, &Snapshot<F>),
        at: Timestamp,
        limits: &PredictionLimits,
        context: &TrackContext<'_>,
    ) {
        // A track of low existence may only be waiting for late data: it is predicted too, and costs more.
        let away = (at - estimate.state.at()).abs();
        if away > limits.memory && track.holders.is_all() {
            return;
        }
        self.tracks.push(index);
        if away > context.synchronous {
            self.due.push(Due { place: self.states.len(), class: estimate.motion_class(), to: at });
        }
        // Predicted in its place: states are large, and a copy costs as much as the prediction.
        self.states.push(estimate.state);
        let existence = estimate.existence_at(at);
        self.estimates.push(Known {
            class: estimate.class(),
            existence,
            shared_error: estimate.shared_error,
            by_positions: estimate.orientation.expected(at, estimate.motion_class()),
        });
    }

    fn clear(&mut self) {
        self.tracks.clear();
        self.states.clear();
        self.measurements.clear();
        self.due.clear();
        self.estimates.clear();
    }

    /// Adds a version of a predicted track, which is at this index of the store.
    pub(super) fn add_version(&mut self, of: usize, index: usize) {
        self.tracks.push(index);
        self.states.push(self.states[of]);
        self.measurements.push(self.measurements[of]);
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.tracks.len()
    }

    /// Indices in the track store, by place.
    pub(crate) fn tracks(&self) -> &[usize] {
        &self.tracks
    }

    /// The predicted state at a place.
    pub(crate) fn state(&self, place: usize) -> &F {
        &self.states[place]
    }

    /// The predicted measurements, by place.
    pub(crate) fn measurements(&self) -> &[PredictedMeasurement] {
        &self.measurements
    }
}

impl Known {
    /// Adds to a predicted measurement what the frame has to do with it.
    #[inline]
    fn complete(&self, predicted: &mut PredictedMeasurement, frame: &StoredFrame) {
        let own = frame.pose_variance(predicted.position);
        predicted.by_positions = self.by_positions;
        predicted.widen_position(self.shared_error.apart(frame.agent, own));
        if let Some(coverage) = &frame.coverage
            && coverage.covers(predicted.position, 0.0)
        {
            let probability = coverage.detection_probability(predicted.position, self.class.group());
            predicted.report_probability = self.existence * probability;
        }
    }
}

/// The circle in which a frame's detections and its coverage lie.
struct Region {
    centre: [f64; 2],
    radius_m: f64,
}

impl Region {
    /// `None` for a frame without detections and coverage.
    fn of(frame: &FrameView<'_>) -> Option<Self> {
        let positions = || frame.measurements.iter().map(|z| z.position);
        let coverage: Option<&Coverage> = frame.stored.coverage.as_ref();
        let centre = match coverage {
            Some(coverage) => [coverage.pose.x, coverage.pose.y],
            None => positions().next()?,
        };
        let farthest = positions().map(|position| squared_distance(position, centre)).fold(0.0, f64::max);
        let range = coverage.map_or(0.0, |coverage| coverage.field_of_view.range_max_m);
        let variance = frame.measurements.iter().map(|z| z.r.xx.max(z.r.yy)).fold(0.0, f64::max);
        let margin = REGION_MARGIN_M + REGION_SIGMAS * libm::sqrt(variance);
        Some(Self { centre, radius_m: libm::sqrt(farthest).max(range) + margin })
    }

    /// Whether a track that was there can be concerned at a time before or after.
    fn may_hold(&self, track: &Whereabouts, at: Timestamp) -> bool {
        let away_s = (at - track.at).abs().as_secs_f64();
        let reach = self.radius_m + REGION_SPEED_MPS * away_s + REGION_SIGMAS * track.sigma_m;
        squared_distance(track.position, self.centre) <= reach * reach
    }
}

fn squared_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::association::{AssociationConfig, AssociationCost, Associator, ClassRule};
    use crate::filter::{ImmState, State};
    use crate::values::{AgentSlot, DetectionModel, SensorModel};
    use proptest::prelude::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::Covariance2;
    use v2x_common::geometry::Pose;
    use v2x_common::id::{AgentId, FrameId};
    use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(10_000 + ms)
    }

    fn measurement([x, y]: [f64; 2], sigma_m: f64) -> Measurement {
        Measurement {
            class: Class::Car,
            position: [x, y],
            r: Covariance2::isotropic(sigma_m * sigma_m),
            size: [1.8, 4.5],
            relative_variance: [0.04; 2],
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            yaw: 0.3,
            yaw_variance: 0.01,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        }
    }

    fn coverage(range_m: f64) -> Coverage {
        let description = SensorDescription {
            revision: 1,
            kind: SensorKind::RoadsideUnit,
            field_of_view: FieldOfView::omnidirectional(0.0, range_m),
            detection_probability: 0.9,
            clutter_per_m2: 1e-6,
            size_noise: None,
            body: None,
            accuracy: Accuracy { position_m: 0.0, yaw_rad: 0.0, clock_s: 0.0 },
            rate_hz: 10.0,
        };
        SensorModel::default().coverage(&description, Pose { x: 0.0, y: 0.0, yaw: 0.0 })
    }

    fn stored(captured_at: Timestamp, coverage: Option<Coverage>) -> StoredFrame {
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 1, sequence: 1 };
        StoredFrame::for_tests(id, captured_at, AgentSlot::default(), DetectionModel::default(), coverage)
    }

    /// A state with a velocity, from two measurements of an object that drives at up to 50 m/s.
    fn state<F: Filter>(start: [f64; 2], velocity: [f64; 2], sigma_m: f64) -> F {
        let mut state = F::initial(at(0), &measurement(start, sigma_m));
        state.predict(at(100), Class::Car);
        state.update(&measurement([start[0] + 0.1 * velocity[0], start[1] + 0.1 * velocity[1]], sigma_m));
        state
    }

    /// Whether a frame could have any effect on a track of this state, without the region.
    fn can_matter<F: Filter>(state: &F, frame: &FrameView<'_>) -> bool {
        let mut predicted = *state;
        predicted.predict(frame.stored.captured_at, Class::Car);
        let track = predicted.predicted_measurement(Class::Car);
        let mut associator = Associator::default();
        let costs = [
            AssociationCost::Csba,
            AssociationCost::Likelihood,
            AssociationCost::Iou,
            AssociationCost::Euclidean,
        ];
        let is_candidate = costs.into_iter().any(|cost| {
            let config = AssociationConfig {
                cost,
                gate: 25.0,
                turned_headings: true,
                classes: ClassRule::Evidence,
                ..Default::default()
            };
            associator.find_candidates(frame.measurements, &[track], &config);
            !associator.candidates_of(0).is_empty()
        });
        is_candidate || frame.stored.coverage.is_some_and(|coverage| coverage.may_cover(track.position))
    }

    /// The state of a track at first: m, m/s, m.
    #[derive(Clone, Copy, Debug)]
    struct Start {
        position: [f64; 2],
        velocity: [f64; 2],
        sigma_m: f64,
    }

    fn starts() -> impl Strategy<Value = Start> {
        let position = [-1500.0..1500.0_f64, -1500.0..1500.0];
        let velocity = [-50.0..50.0_f64, -50.0..50.0];
        let sigma_m = prop_oneof![0.05..2.0_f64, 2.0..60.0];
        (position, velocity, sigma_m).prop_map(|(position, velocity, sigma_m)| Start {
            position,
            velocity,
            sigma_m,
        })
    }

    proptest! {
        #[test]
        fn a_track_outside_of_the_region_cannot_be_detected_or_missed_by_the_frame(
            start in starts(),
            frame_ms in -400..2000_i64,
            detections in prop::collection::vec(([-400.0..400.0_f64, -400.0..400.0], 0.05..30.0_f64), 0..6),
            range_m in prop::option::of(10.0..300.0_f64),
        ) {
            let measurements: Vec<_> = detections.iter().map(|(place, sigma)| measurement(*place, *sigma)).collect();
            let stored = stored(at(frame_ms), range_m.map(coverage));
            let frame = FrameView { slot: FrameSlot(0), stored: &stored, measurements: &measurements };
            let cv: State = state(start.position, start.velocity, start.sigma_m);
            let imm: ImmState = state(start.position, start.velocity, start.sigma_m);
            let (holds_cv, holds_imm) = Region::of(&frame).map_or((false, false), |region| {
                (
                    region.may_hold(&Whereabouts::of_state(&cv), at(frame_ms)),
                    region.may_hold(&Whereabouts::of_state(&imm), at(frame_ms)),
                )
            });
            prop_assert!(holds_cv || !can_matter(&cv, &frame));
            prop_assert!(holds_imm || !can_matter(&imm, &frame));
        }
    }

    #[test]
    fn the_region_leaves_out_what_is_far_away_and_holds_what_is_near() {
        let measurements = [measurement([0.0, 0.0], 0.3)];
        let stored = stored(at(200), Some(coverage(80.0)));
        let frame = FrameView { slot: FrameSlot(0), stored: &stored, measurements: &measurements };
        let region = Region::of(&frame).expect("a detection");
        let may_hold = |x: f64| {
            let state: State = state([x, 0.0], [0.0, 0.0], 0.3);
            region.may_hold(&Whereabouts::of_state(&state), at(200))
        };
        assert!(may_hold(0.0) && may_hold(105.0) && !may_hold(140.0) && !may_hold(10_000.0));
    }

    #[test]
    fn a_frame_without_detections_and_coverage_concerns_no_track() {
        let stored = stored(at(0), None);
        assert!(Region::of(&FrameView { slot: FrameSlot(0), stored: &stored, measurements: &[] }).is_none());
    }
}

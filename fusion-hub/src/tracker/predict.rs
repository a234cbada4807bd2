//! First stage: the tracks that a frame can concern, predicted to its capture time.

use super::config::{Lifetimes, TrackerConfig};
use super::store::TrackStore;
use crate::filter::Filter;
use crate::track::{FrameSlot, StoredFrame, Track, TrackContext};
use crate::values::{Coverage, Measurement, PredictedMeasurement};
use v2x_common::time::{Span, Timestamp};

/// No object that a frame could detect or miss lies further outside of its region than this, m, with this much more
/// for each second since its state, m/s, and for each metre of its and the measurements' standard deviation.
const REGION_MARGIN_M: f64 = 100.0;
const REGION_SPEED_MPS: f64 = 150.0;
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
}

impl<F> Default for Predictions<F> {
    fn default() -> Self {
        Self { tracks: Vec::new(), states: Vec::new(), measurements: Vec::new() }
    }
}

/// Which tracks are predicted at all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PredictionLimits {
    /// A track further away in time than this is of no frame: as long as a track is kept, so that a gap may be bridged
    /// by data that is still to come.
    memory: Span,
    /// Tracks last detected before are of no frame any more: with a lag they are kept for publishing only.
    last_detected_from: Timestamp,
}

impl PredictionLimits {
    /// `deleted_before` is when tracks must have been detected to be kept without a lag.
    pub(crate) fn new(config: &TrackerConfig, lifetimes: &Lifetimes, deleted_before: Timestamp) -> Self {
        let has_lag = config.hypotheses.lag() > Span::ZERO;
        Self {
            memory: lifetimes.coast + lifetimes.delta_max,
            last_detected_from: if has_lag { deleted_before } else { Timestamp::MIN },
        }
    }
}

impl<F: Filter> Predictions<F> {
    /// Predicts the tracks that a frame can concern to its capture time.
    pub(crate) fn predict(
        &mut self,
        tracks: &TrackStore<F>,
        frame: &FrameView<'_>,
        limits: &PredictionLimits,
        context: &TrackContext<'_>,
    ) {
        self.clear();
        let at = frame.stored.captured_at;
        let Some(region) = Region::of(frame) else { return };
        for (index, track) in tracks.all().iter().enumerate() {
            let away = (at - track.latest().state.at()).abs();
            let is_near = region.may_hold(&track.latest().state, away.as_secs_f64());
            // All versions of a track stay together: particles are resampled with all of theirs.
            if (!is_near && track.holders.is_all()) || track.last_measured_at() < limits.last_detected_from {
                continue;
            }
            self.predict_one((index, track), frame, limits, context);
        }
    }

    fn predict_one(
        &mut self,
        (index, track): (usize, &Track<F>),
        frame: &FrameView<'_>,
        limits: &PredictionLimits,
        context: &TrackContext<'_>,
    ) {
        let at = frame.stored.captured_at;
        let past;
        let estimate = if track.is_newest(at) {
            track.latest()
        } else {
            past = track.filtered_at(at, context);
            &past
        };
        // A track of low existence may only be waiting for late data: it is predicted too, and costs more.
        let away = (at - estimate.state.at()).abs();
        if away > limits.memory && track.holders.is_all() {
            return;
        }
        self.tracks.push(index);
        // Predicted in its place: states are large, and a copy costs as much as the prediction.
        self.states.push(estimate.state);
        let Some(state) = self.states.last_mut() else { return };
        if away > context.synchronous {
            state.predict(at, estimate.motion_class());
        }
        let mut predicted = state.predicted_measurement(estimate.class());
        if let Some(coverage) = &frame.stored.coverage
            && coverage.covers(predicted.position, 0.0)
        {
            predicted.report_probability = estimate.existence_at(at) * (1.0 - coverage.miss_probability);
        }
        self.measurements.push(predicted);
    }

    fn clear(&mut self) {
        self.tracks.clear();
        self.states.clear();
        self.measurements.clear();
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

    /// Whether a track with this state so many seconds before or after can be concerned.
    fn may_hold<F: Filter>(&self, state: &F, away_s: f64) -> bool {
        let (position, sigma_m) = state.rough_position();
        let reach = self.radius_m + REGION_SPEED_MPS * away_s + REGION_SIGMAS * sigma_m;
        squared_distance(position, self.centre) <= reach * reach
    }
}

fn squared_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

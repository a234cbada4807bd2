//! The tracks that a frame can concern.

use super::Tracker;
use crate::agents::Agents;
use crate::filter::{Filter, Measurement};
use crate::frames::FrameSlot;
use crate::sensing::Look;
use crate::track::Track;
use v2x_common::time::Span;

/// No object that a frame could report or miss lies further outside of its region than this, m, with this
/// much more for each second since its state, m/s, and for each metre of its and the reports' standard deviation.
const REGION_MARGIN_M: f64 = 100.0;
const REGION_SPEED_MPS: f64 = 150.0;
const REGION_SIGMAS: f64 = 10.0;

impl<F: Filter> Tracker<F> {
    /// The tracks that the frame can concern, as they stood at its time.
    pub(super) fn expect_tracks(&mut self, slot: FrameSlot, agents: &Agents) {
        self.places.clear();
        self.predicted.clear();
        self.expected.clear();
        let records = Self::records(&self.config, &self.frames, agents);
        let frame = self.frames.get(slot);
        let at = frame.captured_at;
        let Some(region) = Region::of(&self.measurements, frame.look.as_ref()) else { return };
        // As long as a track is kept, so that a gap may be bridged by data that is still to come.
        let memory = self.config.coast + self.config.delta_max;
        let has_lag = self.config.lag > Span::ZERO;
        let away_from = |track: &Track<F>| (at - track.latest().state.at()).abs();
        for (place, track) in self.tracks.iter().enumerate() {
            let is_near = region.may_hold(&track.latest().state, away_from(track).as_secs_f64());
            if !is_near && track.holders.is_all() {
                continue;
            }
            // Association stays what it is without a lag.
            if has_lag && track.last_measured_at() < self.gone_before {
                continue;
            }
            let past;
            let known = if track.is_newest(at) {
                track.latest()
            } else {
                past = track.known_at(at, &records);
                &past
            };
            // A track that seems dead may only be waiting for late data: it is expected too, but yields to others.
            let away = (at - known.state.at()).abs();
            // The versions of a track stay in step: particles are drawn with all of theirs.
            if away > memory && track.holders.is_all() {
                continue;
            }
            self.places.push(place);
            // Predicted in its place: states are large, and copies cost as much as the prediction.
            self.predicted.push(known.state);
            if let Some(state) = self.predicted.last_mut() {
                if away > records.synchronous {
                    state.predict(at, known.moves_as());
                }
                let mut expected = state.expected(known.class());
                if let Some(look) = &frame.look
                    && look.covers(expected.position, 0.0)
                {
                    let reported = known.existence_at(at) * (1.0 - look.miss_probability);
                    expected.report_probability = reported;
                }
                self.expected.push(expected);
            }
        }
    }
}

/// Where a frame's reports lie and its sensor looked: a circle.
struct Region {
    centre: [f64; 2],
    radius_m: f64,
}

impl Region {
    /// `None` for a frame that neither reports nor looks.
    fn of(measurements: &[Measurement], look: Option<&Look>) -> Option<Self> {
        let positions = || measurements.iter().map(|z| z.position);
        let centre = match look {
            Some(look) => [look.pose.x, look.pose.y],
            None => positions().next()?,
        };
        let farthest = positions().map(|position| squared_distance(position, centre)).fold(0.0, f64::max);
        let range = look.map_or(0.0, |look| look.field_of_view.range_max_m);
        let variance = measurements.iter().map(|z| z.r.xx.max(z.r.yy)).fold(0.0, f64::max);
        let margin = REGION_MARGIN_M + REGION_SIGMAS * libm::sqrt(variance);
        Some(Self { centre, radius_m: libm::sqrt(farthest).max(range) + margin })
    }

    /// Whether a track with this state so many seconds before or after can be concerned.
    fn may_hold<F: Filter>(&self, state: &F, away_s: f64) -> bool {
        let (position, sigma_m) = state.neighbourhood();
        let reach = self.radius_m + REGION_SPEED_MPS * away_s + REGION_SIGMAS * sigma_m;
        squared_distance(position, self.centre) <= reach * reach
    }
}

fn squared_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

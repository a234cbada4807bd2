//! How many false detections an agent's frames hold: those that no track ever turned out to be real by.
//!
//! A detection is taken for false until its track has shown to be of something real; then all that the track has gathered is
//! taken back. So what is counted is a function of the evidence: when a track is given up does not matter.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Weight of what is assumed or declared, in frames.
const PRIOR_FRAMES: f64 = 20.0;
/// Densities that are learnt are at least and at most this, 1/m²: a sensor that has shown no false detection may yet do so.
const DENSITY: [f64; 2] = [1e-6, 0.1];
/// An agent is trusted whose detections are so many times as often real as false; so many are either before any is seen.
const TRUSTED_ODDS: f64 = 4.0;
const UNDECIDED: f64 = 20.0;
/// A declared density is given up where what is seen differs by this factor, and by so many standard deviations of a frame's
/// number, after so many frames: false detections persist, so that their number scatters by more than by chance.
const CONTRADICTION_FACTOR: f64 = 3.0;
const CONTRADICTION_SIGMAS: f64 = 8.0;
const CONTRADICTION_FRAMES: f64 = 100.0;

/// Counts of one agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ClutterCounts {
    frames: f64,
    detections: f64,
    /// Detections of what turned out to be real.
    real: f64,
}

impl ClutterCounts {
    /// Counts a frame with so many detections.
    pub(super) fn add_frame(&mut self, detections: usize) {
        #[expect(clippy::cast_precision_loss, reason = "a frame's detections are few")]
        let detections = detections as f64;
        self.frames += 1.0;
        self.detections += detections;
    }

    /// Counts detections of something real.
    pub(super) fn add_real(&mut self, detections: u32) {
        self.real += f64::from(detections);
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        self.frames *= factor;
        self.detections *= factor;
        self.real *= factor;
    }

    fn false_detections(&self) -> f64 {
        (self.detections - self.real).max(0.0)
    }

    /// False detections in a frame; `None` before any.
    pub(super) fn per_frame(&self) -> Option<f64> {
        (self.frames > 0.0).then(|| self.false_detections() / self.frames)
    }

    /// Whether what it detects is nearly always real.
    pub(super) fn is_trusted(&self) -> bool {
        self.real + UNDECIDED >= TRUSTED_ODDS * (self.false_detections() + UNDECIDED)
    }

    /// Expected false detections in a frame per m², where this was assumed or declared before any frame, of a view of this area, m².
    pub(super) fn density(&self, before: f64, area_m2: f64) -> f64 {
        let per_frame =
            (self.false_detections() + PRIOR_FRAMES * before * area_m2) / (self.frames + PRIOR_FRAMES);
        let [least, most] = DENSITY;
        (per_frame / area_m2).clamp(least.min(before), most.max(before))
    }

    /// Whether what was seen contradicts a declared density, 1/m², in a view of this area, m².
    pub(super) fn contradict(&self, declared: f64, area_m2: f64) -> bool {
        if self.frames < CONTRADICTION_FRAMES {
            return false;
        }
        let (expected, seen) = (declared * area_m2 * self.frames, self.false_detections());
        let is_off = seen > CONTRADICTION_FACTOR * expected || CONTRADICTION_FACTOR * seen < expected;
        is_off && (seen - expected).abs() > CONTRADICTION_SIGMAS * libm::sqrt(expected.max(1.0))
    }
}

/// The area of a full circle of this radius, m²; of a view that is learnt by how far its detections come from, m.
pub(super) fn circle_m2(radius_m: f64) -> f64 {
    PI * radius_m * radius_m
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![(
        "learning.clutter",
        format!(
            "weight {PRIOR_FRAMES} frames, trusted at {TRUSTED_ODDS} after {UNDECIDED}, within {DENSITY:?}; declared: off by a factor of {CONTRADICTION_FACTOR} and {CONTRADICTION_SIGMAS} sigma after {CONTRADICTION_FRAMES} frames"
        ),
    )]
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA_M2: f64 = 1e4;

    /// After so many frames with ten detections, of which so many are false.
    fn seen(frames: u32, false_ones: u32) -> ClutterCounts {
        let mut counts = ClutterCounts::default();
        for _ in 0..frames {
            counts.add_frame(10);
            counts.add_real(10 - false_ones);
        }
        counts
    }

    #[test]
    fn nothing_seen_is_what_was_assumed_and_much_seen_is_what_was_seen() {
        assert_eq!(ClutterCounts::default().density(1e-3, AREA_M2), 1e-3);
        let much = seen(100_000, 2).density(1e-3, AREA_M2);
        assert!((much / 2e-4 - 1.0).abs() < 0.01, "{much}");
        assert_eq!(seen(1_000_000, 0).density(1e-3, AREA_M2), 1e-6, "never certain");
        assert_eq!(seen(1_000_000, 0).density(0.0, AREA_M2), 0.0, "but where that is declared");
    }

    #[test]
    fn an_agent_is_trusted_whose_detections_nearly_always_turn_out_to_be_real() {
        assert!(!ClutterCounts::default().is_trusted() && !seen(5, 0).is_trusted());
        assert!(seen(100, 1).is_trusted() && !seen(1000, 3).is_trusted());
    }

    #[test]
    fn a_declared_density_is_given_up_where_many_frames_hold_several_times_as_many_or_hardly_any() {
        // Two in each frame.
        assert!(!seen(2000, 2).contradict(2e-4, AREA_M2) && !seen(2000, 2).contradict(4e-4, AREA_M2));
        assert!(seen(2000, 2).contradict(1e-6, AREA_M2) && seen(2000, 0).contradict(2e-4, AREA_M2));
        assert!(!seen(50, 9).contradict(1e-6, AREA_M2), "too few frames");
        assert!(!seen(2000, 0).contradict(1e-7, AREA_M2), "two expected, none seen");
    }
}

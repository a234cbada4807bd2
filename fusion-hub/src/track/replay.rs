//! Replay of late evidence: of one track, one item after the other; of several tracks together.

use super::TrackContext;
use super::application::{apply, initial};
use super::evidence::Evidence;
use super::snapshot::Snapshot;
use super::together::{Run, Source, TOGETHER, Together};
use super::track::Track;
use crate::filter::Filter;
use crate::values::CompactMeasurement;
use v2x_common::time::Timestamp;

/// From so many tracks on it is faster together.
const FEWEST: usize = 2;

/// Measurements that are fetched together before a replay: each lies in another frame, and fetching them one by one
/// waits for the memory each time.
const GATHERED: usize = 16;

impl<F: Filter> Track<F> {
    /// Sets it back to before its late items; how many are applied then. `None` where it has none.
    fn begin_replay(&mut self, context: &TrackContext<'_>) -> Option<usize> {
        let place = self.stale_from.take()?;
        self.checkpoints.truncate(place);
        self.rewind(context)
    }

    /// Keeps a checkpoint after so many items, the last one of them of this time, where that is due.
    fn keep(&mut self, (count, at): (usize, Timestamp), known: &Snapshot<F>) {
        let total = self.evidence.len();
        if self.checkpoints.is_due((count, at), total) {
            self.checkpoints.push((count, at), known, total);
        }
    }

    /// Applies late items at their own times, and every later one again after them.
    pub fn replay(&mut self, context: &TrackContext<'_>) {
        let Some(mut count) = self.begin_replay(context) else { return };
        let total = self.evidence.len();
        let mut gathered = [CompactMeasurement::BLANK; GATHERED];
        while count < total {
            let block = self.evidence.range(count..total.min(count + GATHERED));
            for (held, item) in gathered.iter_mut().zip(block.clone()) {
                if let Some(found) = context.frames.held(item) {
                    *held = *found;
                }
            }
            for (held, item) in gathered.iter().zip(block) {
                let held = (item.is_detection()).then_some(held);
                apply(&mut self.head, (item, held), None, context);
                count += 1;
                if self.checkpoints.is_due((count, item.captured_at), total) {
                    self.checkpoints.push((count, item.captured_at), &self.head, total);
                }
            }
        }
    }

    /// Sets the head back to the last checkpoint, or to the first detection; the number of items before it.
    fn rewind(&mut self, context: &TrackContext<'_>) -> Option<usize> {
        if let Some((count, snapshot)) = self.checkpoints.last() {
            self.head = *snapshot;
            return Some(count);
        }
        let first = self.evidence.iter().position(|item| item.is_detection())?;
        let item = &self.evidence[first];
        self.head = initial(item, context)?;
        self.checkpoints.push((first + 1, item.captured_at), &self.head, self.evidence.len());
        Some(first + 1)
    }
}

/// Tracks that are being replayed.
struct Replayed<'a, F>(&'a mut [Track<F>]);

impl<F: Filter> Source<F> for Replayed<'_, F> {
    #[inline(always)]
    fn item(&self, track: usize, number: usize) -> Option<&Evidence> {
        self.0[track].item(number)
    }

    #[inline(always)]
    fn note_applied(&mut self, run: &Run<F>, at: Timestamp) {
        self.0[run.track].keep((run.count, at), &run.known);
    }
}

/// Replays tracks. The memory is used again.
#[derive(Debug)]
pub(crate) struct Replayer<F> {
    runs: Vec<Run<F>>,
    together: Together,
}

impl<F> Default for Replayer<F> {
    fn default() -> Self {
        Self { runs: Vec::new(), together: Together::default() }
    }
}

impl<F: Filter> Replayer<F> {
    /// Replays the tracks at these places.
    pub(crate) fn replay(&mut self, tracks: &mut [Track<F>], places: &[usize], context: &TrackContext<'_>) {
        if !F::TOGETHER || places.len() < FEWEST {
            places.iter().for_each(|place| tracks[*place].replay(context));
            return;
        }
        let Self { runs, together } = self;
        for places in places.chunks(TOGETHER) {
            runs.clear();
            runs.extend(places.iter().filter_map(|place| {
                let track = &mut tracks[*place];
                let count = track.begin_replay(context)?;
                Some(Run { track: *place, count, end: track.evidence.len(), known: track.head })
            }));
            together.run(runs, &mut Replayed(tracks), context);
            for run in runs.iter() {
                tracks[run.track].head = run.known;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{ImmState, State};
    use crate::track::{FrameStore, PastReader, Rollback, SensedFrame};
    use crate::values::{AgentNames, DetectionModel, HeadingLaw, SensingDefaults, SensorModel};
    use proptest::prelude::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
    use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
    use v2x_common::geometry::BevBox;
    use v2x_common::id::{AgentId, FrameId, TrackId};
    use v2x_common::time::Span;

    /// What an object is reported as in a frame; `None` where it is missed.
    type Report = Option<(f64, f64, bool)>;

    fn detection(track: usize, ms: i64, (off, yaw, has_velocity): (f64, f64, bool)) -> Detection {
        let class = if track % 3 == 1 { Class::Adult } else { Class::Car };
        let velocity = Velocity { x: 8.0, y: 0.5, covariance: Covariance2::isotropic(0.5) };
        Detection {
            class,
            score: 0.9,
            bev: BevBox { x: 8e-3 * ms as f64 + off, y: 20.0 * track as f64, w: 1.8, d: 4.5, yaw },
            covariance: BoxCovariance {
                position: Covariance2 { xx: 0.09, xy: 0.02, yy: 0.16 },
                ww: 0.03,
                dd: 0.2,
                yaw: 0.01,
            },
            velocity: has_velocity.then_some(velocity),
            heading: HeadingKind::Known,
            source_track: None,
        }
    }

    /// Frames of some tracks, in the order of their arrival: when each was captured, and what it reports of each track.
    fn arrivals() -> impl Strategy<Value = Vec<(i64, Vec<Report>)>> {
        let report = prop::option::weighted(0.8, (-0.5..0.5_f64, -3.1..3.1_f64, prop::bool::weighted(0.1)));
        let frame = (0..900_i64, prop::collection::vec(report, 7));
        prop::collection::vec(frame, 2..40)
    }

    fn assert_same_together<F: Filter>(arrivals: &[(i64, Vec<Report>)]) {
        let mut agents = AgentNames::default();
        let name = AgentId::new("agent").unwrap();
        let slot = agents.slot_for(name);
        let sensing = SensorModel::undescribed(&SensingDefaults::default());
        let model = DetectionModel { headings: HeadingLaw::UNKNOWN, ..sensing.model() };
        let mut frames = FrameStore::default();
        let mut evidence: Vec<Vec<Evidence>> = vec![Vec::new(); 7];
        let mut store = |sequence: u64, ms: i64, reports: &[Report]| {
            let captured_at = Timestamp::EPOCH + Span::from_millis(1000 + ms);
            let seen = reports.iter().enumerate().filter_map(|(track, report)| Some((track, (*report)?)));
            let frame = DetectionFrame {
                id: FrameId { agent: name, epoch: 1, sequence },
                captured_at,
                sensor_pose: None,
                sensor_revision: 0,
                map_frame: None,
                detections: seen.clone().map(|(track, report)| detection(track, ms, report)).collect(),
            };
            let sensed =
                SensedFrame { frame: &frame, agent: slot, sensor: &sensing, model: &model, coverage: None };
            let stored = frames.insert(&sensed);
            for (index, (track, _)) in (0..).zip(seen) {
                evidence[track].push(Evidence::detection(captured_at, stored, index));
            }
            for (track, _) in reports.iter().enumerate().filter(|(_, report)| report.is_none()) {
                evidence[track].push(Evidence::missed(captured_at, stored));
            }
        };
        store(0, 450, &[Some((0.0, 0.1, false)); 7]);
        (1..).zip(arrivals).for_each(|(sequence, (ms, reports))| store(sequence, *ms, reports));
        let context = TrackContext {
            frames: &frames,
            agents: &agents,
            synchronous: Span::from_millis(10),
            rollback: Rollback::Replay,
            keeps_folded: false,
            class_motion: true,
            exclusion: true,
        };
        let mut together: Vec<Track<F>> = Vec::new();
        for (number, items) in (0..).zip(&evidence) {
            let mut track = Track::new(TrackId(number), items[0], None, &context);
            items[1..].iter().for_each(|item| track.insert(*item, None, &context));
            together.push(track);
        }
        let places: Vec<_> = (0..together.len()).collect();
        let mut reader = PastReader::default();
        for ms in [100, 450, 700, 2000] {
            let at = Timestamp::EPOCH + Span::from_millis(1000 + ms);
            let read = reader.read(&together, (&places, at), &context).copied().collect::<Vec<_>>();
            let expected: Vec<_> = together.iter().map(|track| track.filtered_at(at, &context)).collect();
            assert_eq!(format!("{read:?}"), format!("{expected:?}"), "estimates at {ms} ms");
        }
        let mut alone = together.clone();
        let stale: Vec<_> = (0..together.len()).filter(|place| together[*place].is_stale()).collect();
        Replayer::default().replay(&mut together, &stale, &context);
        alone.iter_mut().for_each(|track| track.replay(&context));
        assert!(together.iter().all(|track| !track.is_stale()));
        assert_eq!(format!("{together:?}"), format!("{alone:?}"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn tracks_that_are_replayed_together_have_the_bits_of_one_after_the_other(arrivals in arrivals()) {
            assert_same_together::<ImmState>(&arrivals);
            assert_same_together::<State>(&arrivals);
        }
    }
}

//! The core of a hub: the engine behind the payloads of the network. It is pure, so that a journal of its calls can be computed
//! again to the same bits.

use super::limits::{MAX_BYTES, MAX_WAITING};
use super::settings::{AgentSettings, HubSettings};
use crate::diagnosis::{Finding, Observation, Source, Surroundings, Survey, Tokens};
use crate::engine::{Disposition, Engine, EngineConfig, MAX_AGENTS, Refusal};
use crate::standby::Names;
use crate::values::{Saved, StateError};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::reported::Reported;
use v2x_common::time::{Span, Timestamp};
use v2x_common::unmapped_names::UnmappedNames;
use v2x_common::wire::journal::{Body, Call};
use v2x_common::wire::json::{DecodedDetections, PartialDetection};
use v2x_common::wire::{self, WireError};

/// What became of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Handled {
    /// It was accepted.
    Accepted {
        /// Its number.
        frame: FrameId,
        /// It was captured before the newest one by more than ε_s.
        out_of_sequence: bool,
    },
    /// It was refused.
    Refused(Refusal),
}

/// The engine behind the payloads of the network.
#[derive(Debug)]
pub struct Core {
    settings: HubSettings,
    engine: Engine,
    /// No part of its state: it changes nothing that is fused.
    survey: Survey,
    /// Frames are surveyed: somebody asks for findings.
    is_surveyed: bool,
    /// Under which ids tracks are published.
    names: Names,
}

impl Core {
    /// A core that knows nothing yet.
    pub fn new(settings: HubSettings, engine: impl FnOnce(EngineConfig) -> Engine) -> Self {
        let engine = engine(settings.engine);
        Self::around(settings, engine, Names::default())
    }

    fn around(settings: HubSettings, mut engine: Engine, names: Names) -> Self {
        for (agent, of_agent) in &settings.agents {
            of_agent.sensing.iter().for_each(|sensing| engine.assume(*agent, sensing));
        }
        Self { settings, engine, survey: Survey::default(), is_surveyed: true, names }
    }

    /// The same core without findings, for those who ask for none: to gather what they need costs time with each frame.
    #[must_use]
    pub fn unsurveyed(self) -> Self {
        Self { is_surveyed: false, ..self }
    }

    /// A core that goes on where another one was saved.
    ///
    /// # Errors
    /// Where the bytes are no state that this build saved under such settings.
    pub fn restored(settings: HubSettings, mut state: &[u8]) -> Result<Self, StateError> {
        let mut names = Names::default();
        names.load(&mut state)?;
        let engine = Engine::restored(settings.engine, state)?;
        Ok(Self::around(settings, engine, names))
    }

    /// Everything that decides what it does from now on, but for the settings.
    ///
    /// # Errors
    /// Where the method of fusion does not save its state.
    pub fn save(&self) -> Result<Vec<u8>, StateError> {
        let mut bytes = Vec::new();
        self.names.save(&mut bytes)?;
        self.engine.save(&mut bytes)?;
        Ok(bytes)
    }

    /// The settings.
    pub const fn settings(&self) -> &HubSettings {
        &self.settings
    }

    /// The engine.
    pub const fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Takes in the payload of a detection frame that arrived at `received_at`.
    pub fn handle_frame(&mut self, agent: AgentId, received_at: Timestamp, body: &Body<'_>) -> Handled {
        let DecodedDetections { frame, unmapped_classes, reported } = match self.frame(agent, body) {
            Ok(decoded) => decoded,
            Err(refusal) => {
                self.survey.note_refused(agent, &refusal);
                self.engine.note_refusal(agent, refusal.clone());
                return Handled::Refused(refusal);
            }
        };
        if unmapped_classes.total() > 0 {
            self.engine.note_unmapped_classes(agent, &unmapped_classes);
        }
        self.fuse(&frame, &reported, received_at)
    }

    /// Takes in a frame whose detections are not completed yet, as one of JSON: by the agent's conventions, and with what is
    /// assumed of it. `head` is the frame without detections.
    pub fn handle_reports(
        &mut self,
        head: DetectionFrame,
        reports: impl Iterator<Item = PartialDetection>,
        received_at: Timestamp,
    ) -> Handled {
        let agent = head.id.agent;
        match self.completed(head, reports) {
            Ok(frame) => {
                let reported = Reported::by(&self.settings.of_agent(&agent).conventions, true);
                self.fuse(&frame, &reported, received_at)
            }
            Err(refusal) => {
                self.survey.note_refused(agent, &refusal);
                self.engine.note_refusal(agent, refusal.clone());
                Handled::Refused(refusal)
            }
        }
    }

    fn completed(
        &self,
        mut frame: DetectionFrame,
        reports: impl Iterator<Item = PartialDetection>,
    ) -> Result<DetectionFrame, Refusal> {
        let agent = frame.id.agent;
        if !self.settings.listens_to(&agent) {
            return Err(Refusal::NotListenedTo);
        }
        let AgentSettings { report_defaults, conventions, .. } = self.settings.of_agent(&agent);
        let conversion = conventions.conversion(frame.sensor_pose).map_err(WireError::from)?;
        frame.detections.clear();
        frame.detections.extend(reports.map(|report| report.completed(report_defaults, &conversion)));
        frame.sensor_pose = conversion.sensor_pose();
        frame.captured_at += conventions.time_offset;
        Ok(frame)
    }

    fn fuse(&mut self, frame: &DetectionFrame, reported: &Reported, received_at: Timestamp) -> Handled {
        if self.is_surveyed {
            self.survey.note_frame(&Observation { frame, reported, received_at });
        }
        match self.engine.handle_frame(frame, received_at) {
            Disposition::Accepted { out_of_sequence } => {
                Handled::Accepted { frame: frame.id, out_of_sequence }
            }
            Disposition::Refused(refusal) => {
                self.survey.note_refused(frame.id.agent, &refusal);
                Handled::Refused(refusal)
            }
        }
    }

    /// The frame of a payload as this hub understands it, by the agent's conventions. Nothing is taken in.
    ///
    /// # Errors
    /// Why it would be refused.
    pub fn understood(&self, agent: AgentId, body: &Body<'_>) -> Result<DetectionFrame, Refusal> {
        Ok(self.frame(agent, body)?.frame)
    }

    /// The frame with its detections as they were sent.
    fn frame(&self, agent: AgentId, body: &Body<'_>) -> Result<DecodedDetections, Refusal> {
        if !self.settings.listens_to(&agent) {
            return Err(Refusal::NotListenedTo);
        }
        let AgentSettings { report_defaults, says_sigma, conventions, .. } = self.settings.of_agent(&agent);
        let mut decoded = match *body {
            Body::TooLarge(bytes) => return Err(too_large(bytes)),
            Body::Postcard(bytes) => {
                let mut frame = wire::detections::decode_as_sent(bytes)?;
                let mut reported = Reported::by(conventions, true);
                let places = frame.detections.iter().map(|one| [one.bev.x, one.bev.y]);
                let off = places.filter_map(|place| conventions.frame.off_origin(place));
                off.for_each(|off| reported.off_origin.note(off));
                conventions.convert(&mut frame).map_err(WireError::from)?;
                DecodedDetections { frame, unmapped_classes: UnmappedNames::default(), reported }
            }
            Body::Json(bytes) => {
                wire::json::decode_detections_by(bytes, agent, report_defaults, conventions)?
            }
        };
        if decoded.frame.id.agent != agent {
            return Err(Refusal::AgentMismatch { payload: decoded.frame.id.agent, key: agent });
        }
        decoded.reported.sigma_is_set = *says_sigma;
        Ok(decoded)
    }

    /// Takes in the payload of a sensor description; of an agent that is not listened to nothing is taken.
    ///
    /// # Errors
    /// Why it is refused; that is counted.
    pub fn handle_description(&mut self, agent: AgentId, body: &Body<'_>) -> Result<(), Refusal> {
        if !self.settings.listens_to(&agent) {
            return Ok(());
        }
        let description = match *body {
            Body::TooLarge(bytes) => Err(too_large(bytes)),
            Body::Postcard(bytes) => wire::sensor::decode(bytes).map_err(Refusal::from),
            Body::Json(bytes) => wire::json::decode_sensor(bytes).map_err(Refusal::from),
        };
        match description {
            Ok(description) => {
                let taken = self.engine.handle_description(agent, description);
                taken.map_err(WireError::from)?;
                // Beyond the limit it is known nowhere.
                let is_known = self.engine.agents().record(&agent).is_some();
                if is_known { Ok(()) } else { Err(Refusal::TooManyAgents { limit: MAX_AGENTS }) }
            }
            Err(error) => {
                tracing::debug!(%agent, %error, "sensor description refused");
                self.engine.note_refused_description(agent, error.clone());
                Err(error)
            }
        }
    }

    /// Counts frames that were dropped because their agent's queue was full.
    pub fn note_queue_full(&mut self, agent: AgentId, count: u64) {
        let refusal = Refusal::QueueFull { limit: MAX_WAITING };
        self.survey.note_refusals(agent, &refusal, count);
        self.engine.note_refusals(agent, refusal, count);
    }

    /// The system's clock was set, and is now so far ahead of the hub's timeline.
    pub fn note_clock_step(&mut self, step: Span) {
        self.engine.note_clock_step(step);
    }

    /// The hub did not run for a while until `now`.
    pub fn note_held_up(&mut self, now: Timestamp, lasted: Span) {
        self.engine.note_held_up(now, lasted);
    }

    /// The list as of `now`. An object that a hub before this one had listed has the id that it had there.
    pub fn fused(&mut self, now: Timestamp) -> &FusedFrame {
        let list = self.engine.fused(now);
        self.survey.note_list(list);
        self.names.renamed(list)
    }

    /// The list as of `now` while another hub publishes; its number of objects. Nobody gets it.
    pub fn unpublished(&mut self, now: Timestamp) -> usize {
        let list = self.engine.fused(now);
        self.survey.note_list(list);
        self.names.note_own(list);
        list.objects.len()
    }

    /// Takes in a list of the hub that publishes while this one stands by.
    pub fn follow(&mut self, list: &FusedFrame) {
        self.names.follow(list, self.settings.engine.lineage);
    }

    /// How many tracks have an id that another hub gave.
    pub fn named_by_another(&self) -> usize {
        self.names.count()
    }

    /// Judges what is wrong with the agents. To be called about twice a second.
    pub fn diagnose(&mut self, tokens: &Tokens, now: Timestamp) {
        self.survey.diagnose(&Surroundings { engine: &self.engine, tokens, source: Source::Network }, now);
    }

    /// The same of everything since the last ten seconds were over, at the end of a listening time.
    pub fn conclude(&mut self, tokens: &Tokens) {
        self.survey.conclude(&Surroundings { engine: &self.engine, tokens, source: Source::Network });
    }

    /// The findings of the last diagnosis.
    pub fn findings(&self) -> &[Finding] {
        self.survey.findings()
    }

    /// Statistics of what arrives.
    pub const fn survey(&self) -> &Survey {
        &self.survey
    }

    /// The second list as of `now`, where there is one.
    pub fn lagged(&mut self, now: Timestamp) -> Option<&FusedFrame> {
        let list = self.engine.lagged(now)?;
        Some(self.names.renamed(list))
    }

    /// Makes a call of a journal again; the list that it makes.
    pub fn repeat(&mut self, call: &Call<'_>) -> Option<&FusedFrame> {
        match call {
            Call::Frame { agent, received_at, body } => {
                self.handle_frame(*agent, *received_at, body);
                None
            }
            Call::Description { agent, body } => {
                // A refused one was counted, as it was then.
                let _ = self.handle_description(*agent, body);
                None
            }
            Call::QueueFull { agent, count } => {
                self.note_queue_full(*agent, *count);
                None
            }
            Call::Fused { now } => Some(self.fused(*now)),
            Call::Lagged { now } => self.lagged(*now),
            Call::HeldUp { now, lasted } => {
                self.note_held_up(*now, *lasted);
                None
            }
            Call::ClockStep { step } => {
                self.note_clock_step(*step);
                None
            }
            Call::Followed { list } => {
                // It could be read when it was noted.
                if let Ok(list) = wire::fused::decode(list) {
                    self.follow(&list);
                }
                None
            }
            Call::Unpublished { now } => {
                self.unpublished(*now);
                None
            }
        }
    }
}

fn too_large(bytes: u64) -> Refusal {
    Refusal::TooLarge { bytes: usize::try_from(bytes).unwrap_or(usize::MAX), limit: MAX_BYTES }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::fused::FusedObject;
    use v2x_common::geometry::BevBox;
    use v2x_common::wire::json::PartialSigma;

    /// What a hub with these settings publishes after frames that `json` writes for each of ten times, ms.
    fn published(settings: &str, json: impl Fn(i64) -> String) -> Vec<FusedObject> {
        let settings = HubSettings::from_table(settings.parse().unwrap()).unwrap();
        let mut core = Core::new(settings, Engine::new);
        let agent = AgentId::new("cam").unwrap();
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(1_790_000_000_000 + ms);
        for ms in (0..1000).step_by(100) {
            let handled = core.handle_frame(agent, at(ms + 20), &Body::Json(json(ms).as_bytes()));
            assert!(matches!(handled, Handled::Accepted { .. }), "{handled:?}");
        }
        core.fused(at(920)).objects.clone()
    }

    #[test]
    fn a_detector_with_conventions_of_its_own_gives_the_list_that_it_would_give_with_ours() {
        // A van at 10 m/s to the north-east, 40 m and more from a sensor that looks north.
        let east = |ms: i64| 30.0 + 7.0 * ms as f64 * 1e-3;
        let stamp = |ms: i64| 1_790_000_000_000_000 + 1000 * ms;
        let ours = published("", |ms| {
            format!(
                r#"{{"captured_at":{},"sensor_pose":{{"x":0,"y":0,"yaw":1.5707963267948966}},"detections":[{{"class":"van","x":{x},"y":{x},"w":2,"d":5,"yaw":0.7853981633974483,"sigma":{{"x":0.3,"y":0.3,"w":0.2,"d":0.3,"yaw":0.05}}}}]}}"#,
                stamp(ms),
                x = east(ms)
            )
        });
        // From the sensor: y ahead of it, x to its right is to the left with the other sign; compass; the clock is 300 ms behind.
        let settings = "[agents.cam]\nframe = \"sensor\"\npose = { x = 0, y = 0, yaw = 1.5707963267948966 }\n\
             yaw = { unit = \"deg\", turn = \"cw\" }\nsizes = \"w-along\"\ntime_offset_ms = 300\nclasses = { Bus = \"van\" }";
        let theirs = published(settings, |ms| {
            format!(
                r#"{{"captured_at":{},"detections":[{{"class":"Bus","x":{x},"y":-{x},"w":5,"d":2,"yaw":45,"sigma":{{"x":0.3,"y":0.3,"w":0.3,"d":0.2,"yaw":2.864788975654116}}}}]}}"#,
                stamp(ms) - 300_000,
                x = east(ms)
            )
        });
        let (ours, theirs) = match (&ours[..], &theirs[..]) {
            ([ours], [theirs]) => (ours, theirs),
            lists => panic!("one object each, not {lists:?}"),
        };
        assert_eq!(ours.class, theirs.class);
        let values = |object: &FusedObject| {
            let BevBox { x, y, w, d, yaw } = object.bev;
            [x, y, w, d, yaw, object.velocity.0, object.velocity.1, object.kinematic_covariance[0]]
        };
        for (ours, theirs) in values(ours).into_iter().zip(values(theirs)) {
            assert!((ours - theirs).abs() < 1e-6, "{ours} {theirs}");
        }
    }

    #[test]
    fn reports_that_are_not_completed_yet_give_the_list_of_the_same_json() {
        let table = "[agents.cam]\nsigma_position_m = 0.2\nyaw = { unit = \"deg\" }\ntime_offset_ms = 5";
        let x = |ms: i64| 7.0 * ms as f64 * 1e-3;
        let stamp = |ms: i64| 1_790_000_000_000_000 + 1000 * ms;
        let json = published(table, |ms| {
            format!(
                r#"{{"captured_at":{},"detections":[{{"class":"van","x":{},"y":3,"yaw":45}}]}}"#,
                stamp(ms),
                x(ms)
            )
        });
        let mut core = Core::new(HubSettings::from_table(table.parse().unwrap()).unwrap(), Engine::new);
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(1_790_000_000_000 + ms);
        for ms in (0..1000).step_by(100) {
            let sequence = u64::try_from(stamp(ms)).unwrap();
            let id = FrameId { agent: AgentId::new("cam").unwrap(), epoch: 0, sequence };
            let van = PartialDetection {
                class: Class::from_name("van").unwrap(),
                x: x(ms),
                y: 3.0,
                w: None,
                d: None,
                yaw: Some(45.0),
                score: None,
                heading: None,
                sigma: PartialSigma::default(),
                velocity: None,
                source_track: None,
            };
            let head = DetectionFrame::empty(id, at(ms));
            let handled = core.handle_reports(head, std::iter::once(van), at(ms + 20));
            assert!(matches!(handled, Handled::Accepted { .. }), "{handled:?}");
        }
        assert_eq!(core.fused(at(920)).objects, json);
    }

    #[test]
    fn a_flood_of_descriptions_beyond_the_limit_of_agents_is_refused_and_not_counted_as_taken_in() {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let json = br#"{"revision":1,"kind":"vehicle","field_of_view":{"range_min_m":0,"range_max_m":100,"azimuth_rad":0,"width_rad":6.28},"detection_probability":0.9,"clutter_per_m2":1e-4,"accuracy":{"position_m":1,"yaw_rad":0.1,"clock_s":0.1},"rate_hz":10}"#;
        // One that is of use makes no room for others.
        let frame = br#"{"captured_at":1790000000000000,"detections":[]}"#;
        let at = Timestamp::EPOCH + Span::from_millis(1_790_000_000_020);
        let mut describe = |k: usize| {
            let agent = AgentId::new(&format!("a{k}")).unwrap();
            if k < MAX_AGENTS {
                let handled = core.handle_frame(agent, at, &Body::Json(frame));
                assert!(matches!(handled, Handled::Accepted { .. }), "{handled:?}");
            }
            core.handle_description(agent, &Body::Json(json))
        };
        assert!((0..MAX_AGENTS).all(|k| describe(k) == Ok(())));
        assert_eq!(describe(MAX_AGENTS), Err(Refusal::TooManyAgents { limit: MAX_AGENTS }));
        assert_eq!(core.engine().agents().refused_beyond_limit(), 1);
    }

    #[test]
    fn a_frame_whose_positions_are_relative_to_a_pose_that_it_lacks_is_refused_by_reason() {
        let settings = HubSettings::from_table("[agents.cam]\nframe = \"ego\"".parse().unwrap()).unwrap();
        let mut core = Core::new(settings, Engine::new);
        let json = br#"{"captured_at":1790000000000000,"detections":[]}"#;
        let at = Timestamp::EPOCH + Span::from_millis(1_790_000_000_000);
        match core.handle_frame(AgentId::new("cam").unwrap(), at, &Body::Json(json)) {
            Handled::Refused(refusal) => assert_eq!(refusal.reason(), "no_sensor_pose"),
            other => panic!("{other:?}"),
        }
    }
}

//! The interface of fusion methods to the engine.

use crate::learning::LearntSensorReport;
use crate::publish::ObjectList;
use crate::registration::{SharedObject, Source};
use crate::track::Horizon;
use crate::tracker::Innovations;
use crate::values::{AgentNames, AgentSlot, Coverage, PoseErrors, SensorModel, StateError};
use v2x_common::detection::DetectionFrame;
use v2x_common::time::Timestamp;

/// A method that makes one list of objects from the agents' detections: tracking, a rule for the frames of one window, or a
/// method of your own ([`Engine::with_fusion`](crate::engine::Engine::with_fusion)).
///
/// Time comes in as an argument. A method that reads no clock and draws no unseeded random numbers gives the same bits
/// for the same input, live and in the laboratory.
pub trait FusionMethod: std::fmt::Debug + Send {
    /// Takes in a frame. It has been checked, and is not older than Δmax; it may be older than frames that came before
    /// it, of the same agent too.
    fn handle_frame(&mut self, admitted: &AdmittedFrame<'_>) -> FrameOutcome<'_>;

    /// Writes the objects as of `now`, by the hub's clock.
    ///
    /// Objects are distinguished by [`track`](v2x_common::fused::FusedObject::track). Name in [`contributors`](v2x_common::fused::FusedObject::contributors) the detections that an
    /// object was made of: the laboratory scores it by them. [`from_box`](v2x_common::fused::FusedObject::from_box) fills in the rest.
    fn write_objects(&mut self, now: Timestamp, agents: &AgentNames, objects: &mut ObjectList<'_>);

    /// Writes the objects as of an earlier time, by everything that is known by now. Methods without memory cannot.
    fn write_objects_as_of(
        &mut self,
        _at: Timestamp,
        _agents: &AgentNames,
        _objects: &mut ObjectList<'_>,
    ) -> Result<(), NoMemory> {
        Err(NoMemory)
    }

    /// Forgets what can no longer matter. Called often; a method whose memory is bounded needs not do anything.
    fn maintain(&mut self, _now: Timestamp, _horizon: &Horizon, _agents: &AgentNames) {}

    /// The clock of an agent was ahead and has been set back: what it reported of times after `after` was not so. A method
    /// that remembers nothing has nothing to take back.
    fn take_back(&mut self, _agent: AgentSlot, _after: Timestamp, _agents: &AgentNames) {}

    /// What it has learnt of an agent's sensor, for the status; a method that learns nothing knows nothing.
    fn learnt(&self, _agent: AgentSlot) -> Option<LearntSensorReport> {
        None
    }

    /// Appends everything that decides its further lists, so that a recording can be computed again from the middle.
    ///
    /// # Errors
    /// Where it cannot: a method of your own needs not.
    fn save(&self, _out: &mut Vec<u8>) -> Result<(), StateError> {
        Err(StateError::NotSaved)
    }

    /// Takes back what [`Self::save`] of a method of the same settings appended, from the front of the bytes.
    ///
    /// # Errors
    /// Where it cannot, or the bytes are no such state.
    fn load(&mut self, _bytes: &mut &[u8]) -> Result<(), StateError> {
        Err(StateError::NotSaved)
    }

    /// Tracks or objects that it holds, and what happened to them.
    fn counts(&self) -> TrackCounts;
}

/// A frame that the engine has admitted.
#[derive(Clone, Copy, Debug)]
pub struct AdmittedFrame<'a> {
    /// The frame, corrected for the errors of clock and pose that are known of its agent.
    pub frame: &'a DetectionFrame,
    /// When the hub received it, by its clock.
    pub received_at: Timestamp,
    /// How its detections become measurements, by what the agent declares ([`SensorModel::measurement`]).
    pub sensor: &'a SensorModel,
    /// What is unknown of the sensor's pose, beyond what was corrected.
    pub pose_errors: PoseErrors,
    /// Whether the agent describes its sensor.
    pub is_described: bool,
    /// What the sensor covered; `None` where the agent describes no sensor.
    pub coverage: Option<Coverage>,
    /// Slot of the agent.
    pub agent: AgentSlot,
    /// Names of all agents.
    pub agents: &'a AgentNames,
    /// The agent as registration knows it; `None` where it does not.
    pub(crate) source: Option<Source>,
}

/// What a method learnt from a frame about its agent.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameOutcome<'a> {
    /// Innovations of the detections, for the agent's NIS.
    pub innovations: Innovations,
    /// Objects that another agent detects, too, for registration.
    pub shared: &'a [SharedObject],
}

/// A method that keeps no history was asked for an earlier time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this fusion method keeps no history")]
pub struct NoMemory;

/// What a method holds, and what happened to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrackCounts {
    /// Tracks that are held, published or not; of methods without tracks, objects.
    pub tracks: usize,
    /// Detections of new objects that were not taken for lack of room.
    pub births_refused: u64,
    /// Tracks that were merged into an older one of the same object.
    pub merges: u64,
    /// Pairs of a detection and a track that were near enough to be weighed, since this process began.
    pub candidates: u64,
}

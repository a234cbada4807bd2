//! One thing that is probably wrong.

use serde::{Deserialize, Serialize};
use std::fmt;
use v2x_common::id::AgentId;

/// What kind of thing. The names are part of the status.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Code {
    /// Frames arrive before their capture.
    ClockAhead,
    /// Capture times lie behind those of others, as shared objects show.
    ClockBehind,
    /// Frames arrive long after their capture: a slow link, or a clock that is behind.
    ClockBehindOrLinkSlow,
    /// Frames arrive long after their capture, and objects show that the clock is right.
    LinkSlow,
    /// Capture times in another unit, or from another epoch.
    TimeUnit,
    /// The same capture time in all frames.
    OneStamp,
    /// Capture times that scatter.
    StampsJitter,
    /// Headings in degrees.
    Degrees,
    /// Headings that grow clockwise.
    HeadingsMirrored,
    /// Headings from another direction than east.
    HeadingsRotated,
    /// Headings that point backwards.
    HeadingsReversed,
    /// Headings that go with no motion: always the same, of axes without a front, or of something else.
    HeadingsUnfit,
    /// Width and depth the wrong way round.
    SizesSwapped,
    /// Sizes that no such objects have: halves, or in another unit.
    Sizes,
    /// Velocities in another unit, or along other axes.
    Velocities,
    /// Longitudes and latitudes instead of metres.
    Geodetic,
    /// Positions relative to the sensor instead of in the map frame.
    SensorFrame,
    /// Axes that are swapped or point the other way.
    Axes,
    /// Positions in another unit of length.
    LengthUnit,
    /// A sensor's pose by which positions are mapped, and which is wrong.
    SensorPose,
    /// Two agents of one area that see nothing together.
    NothingShared,
    /// Frames of two agents that are displaced or turned against each other.
    Offset,
    /// A pose of the sensor that wanders by more than it says.
    PoseWanders,
    /// The hub has begun again by itself.
    BeganAgain,
    /// Vehicles within each other in one frame.
    Twins,
    /// Frames with other detections under the number of another frame.
    PartialFrames,
    /// Frames that hold, to the last digit, what the one before held.
    Repetition,
    /// Detections that are the hub's own objects.
    Feedback,
    /// Detections that are those of another agent.
    Copy,
    /// Objects that it has lost, and sends on.
    StaleObjects,
    /// Tracks of its own that are not those of objects.
    SourceTracks,
    /// No detection in any frame.
    SeesNothing,
    /// Positions further from the sensor than any sees.
    FarFromSensor,
    /// A described field of view that is not that of its detections.
    FieldOfView,
    /// Positions tens of kilometres from those of everybody else.
    FarAway,
    /// No standard deviations of positions: defaults are in use.
    SigmaMissing,
    /// Standard deviations that are too small.
    SigmaTooSmall,
    /// Standard deviations that are too large.
    SigmaTooLarge,
    /// Class names that no table knows.
    UnknownClasses,
    /// Detections with impossible values.
    ImpossibleDetections,
    /// Frames that are refused, for another reason than those above.
    FramesRefused,
    /// A sensor description that is refused.
    DescriptionRefused,
    /// Two processes use one name.
    TwoProcesses,
    /// Frames that do not arrive.
    Gaps,
    /// Frames that arrive more rarely than declared.
    RateLow,
    /// Times of transport that vary widely.
    Jitter,
    /// Alive, but it sends nothing.
    Silent,
    /// What it rides on is not in the world, and it says so.
    Idle,
    /// Something publishes where no hub reads.
    WrongKey,
    /// Something publishes in a network that no hub serves.
    WrongNetwork,
    /// A name that is not allowed.
    InvalidName,
    /// An agent that the settings name is not there.
    Missing,
    /// No agent sends anything.
    NoAgents,
    /// No object is published, though agents report some that last.
    NothingFused,
    /// No hub serves the network: nobody fuses its frames.
    NoHub,
    /// What a hub says is of an earlier time.
    Outdated,
    /// Two hubs use one name.
    TwoHubs,
    /// The hub has not enough time for what arrives.
    Overload,
    /// The places for sessions are taken, or many of them by one.
    Sessions,
    /// What Zenoh does not let in: handshakes, and messages that the access control denies.
    RefusedByZenoh,
    /// The hub's own recording has ended, or has gaps.
    Recording,
    /// Of two hubs of a name, of which one stands by, the settings differ.
    StandbyDiffers,
    /// Clock and pose errors of more agents are to be estimated than there are places for.
    RegistrationFull,
}

impl Code {
    /// Whether it is of the network as a whole, and not of some agents.
    pub const fn is_of_network(self) -> bool {
        matches!(
            self,
            Self::TwoHubs
                | Self::WrongKey
                | Self::WrongNetwork
                | Self::InvalidName
                | Self::NoAgents
                | Self::NothingFused
                | Self::NoHub
                | Self::Outdated
                | Self::Overload
                | Self::Recording
                | Self::RegistrationFull
                | Self::Sessions
                | Self::StandbyDiffers
                | Self::Silent
        )
    }

    /// As in the status.
    pub fn name(self) -> String {
        let json = serde_json::to_value(self).ok();
        json.as_ref().and_then(|json| json.as_str()).unwrap_or_default().to_owned()
    }
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// What is fused is worse for it, or something is not fused at all.
    Fault,
    /// Worth knowing.
    Note,
}

/// One thing that is probably wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What kind of thing.
    pub code: Code,
    /// How bad it is.
    pub severity: Severity,
    /// Which agent has it; `None` of the network, or where two agents disagree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agent: Option<AgentId>,
    /// What is seen, with its numbers.
    pub says: String,
    /// What to change.
    pub change: String,
}

impl Finding {
    pub(super) fn fault(code: Code, agent: AgentId, says: String, change: impl Into<String>) -> Self {
        Self { code, severity: Severity::Fault, agent: Some(agent), says, change: change.into() }
    }

    pub(super) fn note(code: Code, agent: AgentId, says: String, change: impl Into<String>) -> Self {
        Self { severity: Severity::Note, ..Self::fault(code, agent, says, change) }
    }

    /// Of the network as a whole.
    pub fn of_network(code: Code, says: impl Into<String>, change: impl Into<String>) -> Self {
        Self { code, severity: Severity::Fault, agent: None, says: says.into(), change: change.into() }
    }

    /// Whose it is and what is seen, without what to change.
    pub fn in_short(&self) -> String {
        self.agent.map_or_else(|| self.says.clone(), |agent| format!("{agent}: {}", self.says))
    }

    /// The same, as what is worth knowing.
    #[must_use]
    pub fn as_note(self) -> Self {
        Self { severity: Severity::Note, ..self }
    }

    /// Whether it makes a network degraded.
    pub fn is_fault(&self) -> bool {
        self.severity == Severity::Fault
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(agent) = &self.agent {
            write!(f, "{agent}: ")?;
        }
        write!(f, "{}. {}", self.says, self.change)
    }
}

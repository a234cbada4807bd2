//! Errors of encoding and decoding.

use crate::conventions::UnfitPose;
use crate::detection::InvalidValue;
use crate::id::NameError;
use crate::sensor::InvalidDescription;
use crate::spelling;
use crate::time::StampUnit;
use crate::wire::foreign::Foreign;
use std::fmt::Display;

/// The version that this code writes. A hub reads this one and the one before, where there is one.
pub const VERSION: u8 = 1;

/// Why a payload cannot be decoded, or a frame cannot be encoded.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WireError {
    /// The payload ends too early.
    #[error("truncated payload")]
    Truncated,
    /// Bytes remain after the end of the payload.
    #[error("{0} bytes trail the payload")]
    Trailing(usize),
    /// A version that this code does not read.
    #[error("wire version {0}, this end reads version {VERSION}")]
    UnknownVersion(u8),
    /// A payload of another format.
    #[error("the payload looks like {0}")]
    OtherFormat(Foreign),
    /// Another kind of payload than expected.
    #[error("payload kind {0:#04x} where {1:?} was expected")]
    WrongKind(u8, char),
    /// A flag that this version does not define.
    #[error("unknown flags {0:#04x}")]
    UnknownFlags(u8),
    /// A class byte beyond the table.
    #[error("unknown class byte {0}")]
    UnknownClass(u8),
    /// An integer or a text is not valid postcard.
    #[error("malformed postcard: {0}")]
    Postcard(postcard::Error),
    /// Not a valid name.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A list longer than allowed.
    #[error("{count} {what}, at most {limit}")]
    TooMany {
        /// The kind of item.
        what: &'static str,
        /// The number found.
        count: u64,
        /// The largest number allowed.
        limit: usize,
    },
    /// A number in a frame that is not finite or outside of its limits.
    #[error(transparent)]
    InvalidValue(#[from] InvalidValue),
    /// A number of a fused object that is outside of its limits.
    #[error("{field} of object {index} is {value}, expected {expected}")]
    FusedValue {
        /// The field's name.
        field: &'static str,
        /// The object's place in the frame.
        index: usize,
        /// The value found, in SI units.
        value: f64,
        /// The allowed range, with its unit.
        expected: &'static str,
    },
    /// A number in a sensor description that is not finite or outside of its limits.
    #[error(transparent)]
    Description(#[from] InvalidDescription),
    /// A reference to an agent that the frame does not list.
    #[error("reference to an agent that the frame does not list")]
    UnlistedAgent,
    /// Not JSON, or a field is missing, unknown or of the wrong type ([`WireError::json`]).
    #[error("JSON: {0}")]
    Json(String),
    /// A time stamp of JSON that is no integer of microseconds.
    #[error("captured_at is {value}{}, expected whole microseconds since 1970", StampUnit::in_words(*.value))]
    NotMicroseconds {
        /// The value found, in its own unit.
        value: f64,
    },
    /// Positions are relative to a pose that is not there.
    #[error(transparent)]
    Pose(#[from] UnfitPose),
    /// A value that the wire cannot represent.
    #[error("{field} = {value} does not fit on the wire")]
    NotEncodable {
        /// The field's name.
        field: &'static str,
        /// The value found.
        value: f64,
    },
}

/// Fields as other formats call them, each with what it is here.
const OTHER_NAMES: [(&str, &str); 37] = [
    ("timestamp", "captured_at"),
    ("timestamp_us", "captured_at"),
    ("time", "captured_at"),
    ("stamp", "captured_at"),
    ("ts", "captured_at"),
    ("t", "captured_at"),
    ("objects", "detections"),
    ("boxes", "detections"),
    ("obstacles", "detections"),
    ("agent_id", "agent"),
    ("sensor_id", "agent"),
    ("seq", "sequence"),
    ("frame_id", "sequence"),
    ("pose", "sensor_pose"),
    ("label", "class"),
    ("type", "class"),
    ("category", "class"),
    ("cls", "class"),
    ("name", "class"),
    ("lon", "x"),
    ("longitude", "x"),
    ("lat", "y"),
    ("latitude", "y"),
    ("width", "w"),
    ("length", "d"),
    ("depth", "d"),
    ("l", "d"),
    ("theta", "yaw"),
    ("heading_deg", "yaw"),
    ("angle", "yaw"),
    ("rotation", "yaw"),
    ("confidence", "score"),
    ("probability", "score"),
    ("covariance", "sigma"),
    ("std", "sigma"),
    ("track_id", "source_track"),
    ("id", "source_track"),
];
/// Bytes that are kept of the begin and of the end of a reader's words, which can quote what somebody has sent.
const QUOTED: (usize, usize) = (200, 80);

impl WireError {
    /// Of a reader or writer of JSON, in its words, with the field that is meant by an unknown one; of long ones the begin, which names the field, and the end, which says where.
    pub fn json(error: &impl Display) -> Self {
        let shown = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
        let words = spelling::hinted(&error.to_string(), &OTHER_NAMES);
        let words: String = words.chars().map(shown).collect();
        let (head, tail) = QUOTED;
        if words.len() <= head + tail {
            return Self::Json(words);
        }
        let (begin, end) = (words.floor_char_boundary(head), words.ceil_char_boundary(words.len() - tail));
        Self::Json(format!("{}…{}", &words[..begin], &words[end..]))
    }

    /// A short name of the cause, for counting. Names do not change.
    pub const fn reason(&self) -> &'static str {
        match self {
            Self::Truncated => "truncated",
            Self::Trailing(_) => "trailing_bytes",
            Self::UnknownVersion(_) => "unknown_version",
            Self::OtherFormat(_) => "other_format",
            Self::WrongKind(..) => "wrong_kind",
            Self::UnknownFlags(_) => "unknown_flags",
            Self::UnknownClass(_) => "unknown_class",
            Self::Postcard(_) => "malformed",
            Self::Name(_) => "bad_name",
            Self::TooMany { .. } => "too_many",
            Self::InvalidValue(_) | Self::FusedValue { .. } => "absurd_value",
            Self::Description(_) => "bad_description",
            Self::UnlistedAgent => "unlisted_agent",
            Self::Json(_) => "bad_json",
            Self::NotMicroseconds { .. } => "wrong_time_unit",
            Self::Pose(UnfitPose::Missing) => "no_sensor_pose",
            Self::Pose(UnfitPose::OffOrigin(_)) => "off_origin",
            Self::NotEncodable { .. } => "not_encodable",
        }
    }
}

impl From<postcard::Error> for WireError {
    fn from(error: postcard::Error) -> Self {
        match error {
            postcard::Error::DeserializeUnexpectedEnd => Self::Truncated,
            other => Self::Postcard(other),
        }
    }
}

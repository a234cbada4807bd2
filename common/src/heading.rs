//! What is known of a heading.

/// What is known of a heading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum HeadingKind {
    /// The front is at this heading.
    #[default]
    Known,
    /// The front is at this heading or at the opposite one.
    Axis,
    /// Nothing is known of the heading.
    Unknown,
}

impl HeadingKind {
    /// The kind of a number on the wire.
    pub const fn from_byte(byte: u32) -> Option<Self> {
        match byte {
            0 => Some(Self::Known),
            1 => Some(Self::Axis),
            2 => Some(Self::Unknown),
            _ => None,
        }
    }

    /// The name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Known => "known",
            Self::Axis => "axis",
            Self::Unknown => "unknown",
        }
    }
}

//! What a payload looks like that is none of ours: whoever sends another format wants to know which one arrives.

use std::fmt;

/// A format of another kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// Compressed, by the name of the format.
    Compressed(&'static str),
    /// Binary, by the name of the format.
    Binary(&'static str),
    /// A frame as JSON, under the encoding of the compact format.
    JsonAsCompact,
    /// A list of JSON.
    JsonList,
    /// A text of JSON that holds JSON.
    JsonTwice,
    /// JSON behind a byte order mark.
    ByteOrderMark,
    /// Text in UTF-16.
    Utf16,
    /// Base64.
    Base64,
    /// XML.
    Xml,
    /// Another text.
    Text,
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Compressed(name) | Self::Binary(name) => name,
            Self::JsonAsCompact => "JSON, and its encoding says that it is the compact format",
            Self::JsonList => "a JSON list",
            Self::JsonTwice => "JSON within a JSON text: it was encoded twice",
            Self::ByteOrderMark => "JSON behind a byte order mark",
            Self::Utf16 => "text in UTF-16",
            Self::Base64 => "base64",
            Self::Xml => "XML",
            Self::Text => "text that is no JSON object",
        })
    }
}

/// Formats that begin with bytes of their own.
const MAGIC: [(&[u8], Foreign); 20] = [
    (&[0x1f, 0x8b], Foreign::Compressed("gzip")),
    (&[0x28, 0xb5, 0x2f, 0xfd], Foreign::Compressed("zstd")),
    (&[0x04, 0x22, 0x4d, 0x18], Foreign::Compressed("LZ4")),
    (b"BZh", Foreign::Compressed("bzip2")),
    (&[0xfd, b'7', b'z', b'X', b'Z', 0], Foreign::Compressed("xz")),
    (&[0xff, 0x06, 0, 0, b's', b'N', b'a', b'P', b'p', b'Y'], Foreign::Compressed("snappy")),
    (b"PK\x03\x04", Foreign::Compressed("zip")),
    (&[0x89, b'M', b'C', b'A', b'P'], Foreign::Binary("MCAP")),
    (&[0x93, b'N', b'U', b'M', b'P', b'Y'], Foreign::Binary("an array of NumPy")),
    (b"Obj\x01", Foreign::Binary("Avro")),
    (b"PAR1", Foreign::Binary("Parquet")),
    (b"ARROW1", Foreign::Binary("Arrow")),
    (&[0x80, 0x03, b'}'], Foreign::Binary("a pickle of Python")),
    (&[0x80, 0x04, 0x95], Foreign::Binary("a pickle of Python")),
    (&[0x80, 0x05, 0x95], Foreign::Binary("a pickle of Python")),
    (&[0x89, b'P', b'N', b'G'], Foreign::Binary("a PNG image")),
    (&[0xff, 0xd8, 0xff], Foreign::Binary("a JPEG image")),
    (&[0x00, 0x01, 0x00, 0x00], Foreign::Binary("CDR, as ROS 2 writes its messages")),
    (&[0x00, 0x00, 0x00, 0x00], Foreign::Binary("CDR, as ROS 2 writes its messages")),
    (&[0xd9, 0xd9, 0xf7], Foreign::Binary("CBOR")),
];
/// Bytes of a text that are looked at, and fields of a message.
const LOOKED_AT: usize = 256;
const MAX_FIELDS: usize = 1_024;
/// Shortest text that is none by chance, and base64.
const MIN_TEXT: usize = 8;
const MIN_BASE64: usize = 16;

impl Foreign {
    /// By the first bytes; `None` of what looks like nothing that is known. Only of payloads that are none of ours.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let magic = || MAGIC.iter().find(|(begin, _)| bytes.starts_with(begin)).map(|(_, format)| *format);
        magic().or_else(|| zlib(bytes)).or_else(|| text(bytes)).or_else(|| binary(bytes))
    }

    /// Whether it is text, which a reader of JSON says more about.
    pub const fn is_text(self) -> bool {
        matches!(self, Self::JsonAsCompact | Self::JsonList | Self::Xml | Self::Text)
    }
}

fn text(bytes: &[u8]) -> Option<Foreign> {
    if let Some(rest) = bytes.strip_prefix(b"\xef\xbb\xbf") {
        return (rest.trim_ascii_start().first() == Some(&b'{')).then_some(Foreign::ByteOrderMark);
    }
    let utf16 = [&b"\xff\xfe"[..], b"\xfe\xff", b"{\0", b"\0{"];
    if utf16.into_iter().any(|begin| bytes.starts_with(begin)) {
        return Some(Foreign::Utf16);
    }
    let text = bytes.trim_ascii();
    let head = &text[..text.len().min(LOOKED_AT)];
    let is_text = !head.is_empty()
        && head.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace() || *byte >= 0x80);
    if !is_text || std::str::from_utf8(text).is_err() {
        return None;
    }
    let is_base64 = |byte: &u8| byte.is_ascii_alphanumeric() || b"+/-_=".contains(byte);
    match head {
        [b'{', ..] => Some(Foreign::JsonAsCompact),
        [b'[', ..] => Some(Foreign::JsonList),
        [b'"', b'{' | b'[' | b'\\', ..] => Some(Foreign::JsonTwice),
        [b'<', ..] => Some(Foreign::Xml),
        [b'"', rest @ .., b'"'] if rest.len() >= MIN_BASE64 && rest.iter().all(is_base64) => {
            Some(Foreign::Base64)
        }
        _ if text.len() >= MIN_BASE64 && head.iter().all(is_base64) => Some(Foreign::Base64),
        _ if bytes.first().is_some_and(u8::is_ascii_graphic) && text.len() >= MIN_TEXT => Some(Foreign::Text),
        _ => None,
    }
}

fn zlib(bytes: &[u8]) -> Option<Foreign> {
    let [0x78, flags, _, ..] = bytes else { return None };
    // Header and check of RFC 1950.
    (0x7800 | u16::from(*flags)).is_multiple_of(31).then_some(Foreign::Compressed("zlib"))
}

fn binary(bytes: &[u8]) -> Option<Foreign> {
    match bytes {
        _ if is_msgpack(bytes) => Some(Foreign::Binary("MessagePack")),
        _ if is_cbor(bytes) => Some(Foreign::Binary("CBOR")),
        _ if is_bson(bytes) => Some(Foreign::Binary("BSON")),
        // Version 2 with DENM, CAM or CPM.
        [2, 1 | 2 | 14, _, _, _, _, ..] => Some(Foreign::Binary("a message of ETSI ITS (UPER)")),
        _ if is_protobuf(bytes) => Some(Foreign::Binary("protobuf")),
        _ => None,
    }
}

/// Whether a text of such a length is the name of a field.
fn is_name(bytes: &[u8], length: usize) -> bool {
    length > 0
        && bytes
            .get(..length)
            .is_some_and(|name| name.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' '))
}

/// A map whose first key is a text, or a list of such maps or of numbers.
fn is_msgpack(bytes: &[u8]) -> bool {
    // A value that is a small letter would be the rest of a name of CBOR.
    let is_key = |name: &[u8], length: usize| {
        is_name(name, length) && !name.get(length).is_some_and(u8::is_ascii_lowercase)
    };
    let of_key = |bytes: &[u8]| match bytes {
        [first @ 0xa1..=0xbf, name @ ..] => is_key(name, usize::from(first & 0x1f)),
        [0xd9, length, name @ ..] => is_key(name, usize::from(*length)),
        [0xda, high, low, name @ ..] => is_key(name, usize::from(u16::from_be_bytes([*high, *low]))),
        _ => false,
    };
    match bytes {
        [0x81..=0x8f, key @ ..] | [0xde, _, _, key @ ..] | [0xdf, _, _, _, _, key @ ..] => of_key(key),
        [0x91..=0x9f, rest @ ..] | [0xdc, _, _, rest @ ..] => match rest {
            [0x81..=0x8f, key @ ..] | [0xde, _, _, key @ ..] => of_key(key),
            [0xca | 0xcb | 0xcf | 0xd3, ..] => true,
            _ => of_key(rest),
        },
        _ => false,
    }
}

/// A map whose first key is a text, or a list of such maps.
fn is_cbor(bytes: &[u8]) -> bool {
    let of_key = |bytes: &[u8]| match bytes {
        [first @ 0x61..=0x77, name @ ..] => is_name(name, usize::from(first - 0x60)),
        [0x78, length, name @ ..] => is_name(name, usize::from(*length)),
        _ => false,
    };
    let of_map = |bytes: &[u8]| match bytes {
        [0xa1..=0xb7 | 0xbf, key @ ..] | [0xb8, _, key @ ..] | [0xb9, _, _, key @ ..] => of_key(key),
        _ => false,
    };
    match bytes {
        [0x81..=0x97 | 0x9f, rest @ ..] | [0x98, _, rest @ ..] => of_map(rest),
        _ => of_map(bytes),
    }
}

fn is_bson(bytes: &[u8]) -> bool {
    let [a, b, c, d, .., 0] = bytes else { return false };
    usize::try_from(u32::from_le_bytes([*a, *b, *c, *d])).is_ok_and(|length| length == bytes.len())
}

/// Whether all bytes are fields with numbers and types of their own, up to the end, or to that of a last one that was cut off.
fn is_protobuf(mut bytes: &[u8]) -> bool {
    const MAX_NUMBER: u64 = 2_047;
    // Most messages have few fields.
    const FEW: u64 = 31;
    let mut n = 0;
    while !bytes.is_empty() && n < MAX_FIELDS {
        let Some(tag) = take_varint(&mut bytes) else { return false };
        let length = match tag & 7 {
            0 => take_varint(&mut bytes).map(|_| 0),
            1 => Some(8),
            2 => take_varint(&mut bytes),
            5 => Some(4),
            _ => None,
        };
        let length = length.and_then(|length| usize::try_from(length).ok());
        let is_cut_off = n > 0
            && tag >> 3 <= FEW
            && length.is_some_and(|length| length > bytes.len() && !bytes.is_empty());
        if is_cut_off {
            return true;
        }
        let rest = length.and_then(|length| bytes.get(length..));
        let Some(rest) = rest.filter(|_| (1..=MAX_NUMBER).contains(&(tag >> 3))) else { return false };
        bytes = rest;
        n += 1;
    }
    n > 1
}

fn take_varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for shift in (0..63).step_by(7) {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8]) -> String {
        Foreign::of(bytes).map(|format| format.to_string()).unwrap_or_default()
    }

    #[test]
    fn formats_of_other_programs_are_called_by_their_names() {
        // As Python writes {"captured_at": 1790000000000000, "detections": [{"class": "car", "x": 10.0, "y": 5.0}]}, or a part of it.
        let cases: [(&[u8], &str); 23] = [
            (b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03", "gzip"),
            (b"\x78\x9c\xab\x56\x4a", "zlib"),
            (b"\x78\x01\xab\x56\x4a", "zlib"),
            (b"\x78\xda\xab\x56\x4a", "zlib"),
            (b"\x28\xb5\x2f\xfd\x04\x58", "zstd"),
            (b"\x82\xabcaptured_at\xcf\x00\x06\x5b\xfe", "MessagePack"),
            (b"\x85\xd9\x05epoch\xcf\x00\x06\x5b\xfe", "MessagePack"),
            (b"\x93\xcb\x40\x24\x00\x00\x00\x00\x00\x00", "MessagePack"),
            (b"\xa2kcaptured_at\x1b\x00\x06\x5b\xfe", "CBOR"),
            (b"\x81\xa3eclassccar", "CBOR"),
            (b"\x08\x80\x90\xd4\x8e\xb0\xc2\x99\x03\x12\x05\x0a\x03car", "protobuf"),
            (b"\x08\x80\x90\xd4\x8e\xb0\xc2\x99\x03\x12\x1a\x0a\x03car\x11", "protobuf"),
            (b"\x80\x04\x95\x1a\x00\x00\x00\x00\x00\x00\x00}", "a pickle of Python"),
            (b"\x00\x01\x00\x00\x12\x00\x00\x00", "CDR, as ROS 2 writes its messages"),
            (b"\x02\x02\x00\x00\x30\x39\x00", "a message of ETSI ITS (UPER)"),
            (b"eyJjYXB0dXJlZF9hdCI6IDE3OTAwMDAwMDAwMDAwMDB9", "base64"),
            (b"\"eyJjYXB0dXJlZF9hdCI6IDE3OTAwMDAwMDAwMDAwMDB9\"", "base64"),
            (br#""{\"captured_at\": 1}""#, "JSON within a JSON text: it was encoded twice"),
            (b"[{\"class\": \"car\"}]", "a JSON list"),
            (b"\xef\xbb\xbf{\"captured_at\": 1}", "JSON behind a byte order mark"),
            (b"\xff\xfe{\0\"\0", "text in UTF-16"),
            (b"<cam><x>1</x></cam>", "XML"),
            (b"car,10.0,5.0", "text that is no JSON object"),
        ];
        for (bytes, name) in cases {
            assert_eq!(of(bytes), name, "{}", bytes.escape_ascii());
        }
        let bson = b"\x16\x00\x00\x00\x01x\x00\x00\x00\x00\x00\x00\x00\x24\x40\x10y\x00\x05\x00\x00\x00\x00";
        let mut bson = bson.to_vec();
        bson[0] = u8::try_from(bson.len()).unwrap();
        assert_eq!(of(&bson), "BSON");
    }

    #[test]
    fn what_looks_like_nothing_that_is_known_has_no_name() {
        for bytes in [&b""[..], b"\x09D", b"\x63D\x01\x02", b"\x02D\x00", b"\xc3\x28\x01", b"\x00"] {
            assert_eq!(Foreign::of(bytes), None, "{}", bytes.escape_ascii());
        }
        for n in 0..4_000_u32 {
            let bytes: Vec<u8> =
                (0..n % 40).map(|k| (n.wrapping_mul(2_654_435_761) >> (k % 24)) as u8).collect();
            let _ = Foreign::of(&bytes);
        }
    }
}

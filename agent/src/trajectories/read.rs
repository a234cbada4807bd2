//! From text to traffic.

use std::io::BufRead;

use super::error::TrafficError;
use super::options::ReadOptions;
use super::traffic::Traffic;
use super::{fcd, table};

/// Reads recorded traffic in any of the formats. Each object and time is kept once, 40 bytes a row; the rest streams.
pub fn read(mut input: impl BufRead, options: &ReadOptions) -> Result<Traffic, TrafficError> {
    let start = input.fill_buf()?;
    if start.starts_with(&[0x1f, 0x8b]) {
        return Err(TrafficError::Format("is compressed by gzip; unpack it with gunzip first"));
    }
    if start.starts_with(&[0xff, 0xfe]) || start.starts_with(&[0xfe, 0xff]) {
        return Err(TrafficError::Format("is UTF-16; save it as UTF-8"));
    }
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    let Some(first) = text.iter().find(|byte| !byte.is_ascii_whitespace()) else {
        return Err(TrafficError::Empty(", and is empty".to_owned()));
    };
    match first {
        b'<' => fcd::read(input, options),
        b'{' | b'[' => Err(TrafficError::Format("is JSON; expected CSV, or SUMO's XML of sumo --fcd-output")),
        _ => {
            let delimiter = delimiter(text);
            table::read(input, delimiter, options)
        }
    }
}

/// The separator that the first line has most of.
fn delimiter(text: &[u8]) -> u8 {
    let line = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let count = |delimiter: u8| line.iter().filter(|byte| **byte == delimiter).count();
    // Of equal numbers the last one counts.
    [b'\t', b';', b','].into_iter().max_by_key(|delimiter| count(*delimiter)).unwrap_or(b',')
}

//! From text to traffic.

use std::io::BufRead;

use super::error::TrafficError;
use super::options::ReadOptions;
use super::traffic::Traffic;
use super::xml::{Next, Xml};
use super::{commonroad, fcd, table};

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
        b'<' => xml(Xml::new(input), options),
        b'{' | b'[' => Err(TrafficError::Format(
            "is JSON; expected CSV, or the XML of SUMO (--fcd-output) or CommonRoad; of nuScenes name the folder of its tables",
        )),
        _ => {
            let delimiter = separator_of(text);
            table::read(input, delimiter, options)
        }
    }
}

/// Reads XML by its root.
fn xml(mut xml: Xml<impl BufRead>, options: &ReadOptions) -> Result<Traffic, TrafficError> {
    let root = match xml.next()? {
        Next::Element(root) => root,
        Next::End(_) => return Err(TrafficError::Empty(", and no element".to_owned())),
    };
    match root.name.as_str() {
        fcd::ROOT => fcd::read(xml, options),
        commonroad::ROOT => commonroad::read(xml, &root, options),
        config @ ("configuration" | "sumoConfiguration") => {
            let cause = format!(
                "the root is <{config}>, of a configuration of SUMO: name it with the prefix sumo:, as in  v2x scenario init \
                 --world sumo:FILE  (in a scenario kind = \"sumo\")"
            );
            Err(TrafficError::Xml { line: root.line, cause })
        }
        other => {
            let cause = format!(
                "the root is <{other}>, expected <{}> (of sumo --fcd-output FILE) or <{}>",
                fcd::ROOT,
                commonroad::ROOT
            );
            Err(TrafficError::Xml { line: root.line, cause })
        }
    }
}

/// The separator that the first line of a table has most of.
pub fn separator_of(text: &[u8]) -> u8 {
    let line = text.trim_ascii_start().split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default();
    let count = |delimiter: u8| line.iter().filter(|byte| **byte == delimiter).count();
    // Of equal numbers the last one counts.
    [b'\t', b';', b','].into_iter().max_by_key(|delimiter| count(*delimiter)).unwrap_or(b',')
}

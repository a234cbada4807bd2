//! XML that is read element by element.

use std::io::{self, BufRead, Read};

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};

use super::error::{Part, TrafficError};

/// Elements within each other: no format that is read here has more.
const DEEPEST: usize = 32;

/// Counts lines.
struct LineCounter<R> {
    inner: R,
    n_lines: u64,
}

impl<R: BufRead> Read for LineCounter<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(buffer)?;
        self.consume(n);
        Ok(n)
    }
}

impl<R: BufRead> BufRead for LineCounter<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.inner.fill_buf()
    }

    fn consume(&mut self, n: usize) {
        // What is consumed is in the buffer, so that nothing is read here.
        let consumed = self.inner.fill_buf().map_or(&[][..], |buffer| &buffer[..n.min(buffer.len())]);
        self.n_lines += consumed.iter().fold(0, |lines, byte| lines + u64::from(*byte == b'\n'));
        self.inner.consume(n);
    }
}

/// A stream of elements, in which one is in memory.
pub(super) struct Xml<R> {
    reader: quick_xml::Reader<LineCounter<R>>,
    buffer: Vec<u8>,
    depth: usize,
    /// Whether an element without content was opened.
    is_closing: bool,
}

/// The beginning of an element.
pub(super) struct Element {
    pub(super) name: String,
    attributes: Vec<(String, String)>,
    pub(super) line: u64,
}

/// What comes next.
pub(super) enum Item {
    Open(Element),
    Text(String),
    /// The end of an element, and its line.
    Close(u64),
    /// The end; the argument says whether all elements were closed.
    End(bool),
}

/// What comes next where only the beginnings of elements count.
pub(super) enum Next {
    Element(Element),
    /// The end; the argument says whether all elements were closed.
    End(bool),
}

impl<R: BufRead> Xml<R> {
    pub(super) fn new(input: R) -> Self {
        let reader = quick_xml::Reader::from_reader(LineCounter { inner: input, n_lines: 1 });
        Self { reader, buffer: Vec::new(), depth: 0, is_closing: false }
    }

    /// The next element that begins.
    pub(super) fn next(&mut self) -> Result<Next, TrafficError> {
        loop {
            match self.item()? {
                Item::Open(element) => return Ok(Next::Element(element)),
                Item::End(is_whole) => return Ok(Next::End(is_whole)),
                Item::Text(_) | Item::Close(_) => {}
            }
        }
    }

    /// The next beginning, text or end.
    pub(super) fn item(&mut self) -> Result<Item, TrafficError> {
        loop {
            let line = self.reader.get_ref().n_lines;
            if std::mem::take(&mut self.is_closing) {
                return Ok(Item::Close(line));
            }
            self.buffer.clear();
            let event = match self.reader.read_event_into(&mut self.buffer) {
                Ok(event) => event,
                Err(cause) => return self.broken(&cause),
            };
            let line = self.reader.get_ref().n_lines;
            let wrong = |cause: String| TrafficError::Xml { line, cause };
            match event {
                Event::Start(start) => {
                    self.depth += 1;
                    if self.depth > DEEPEST {
                        return Err(wrong(format!("more than {DEEPEST} elements within each other")));
                    }
                    return element(&start, line).map(Item::Open).map_err(wrong);
                }
                Event::Empty(start) => {
                    self.is_closing = true;
                    return element(&start, line).map(Item::Open).map_err(wrong);
                }
                Event::Text(text) => {
                    return Ok(Item::Text(String::from_utf8_lossy(text.as_ref().as_bytes()).into_owned()));
                }
                Event::End(_) => {
                    self.depth = self.depth.saturating_sub(1);
                    return Ok(Item::Close(line));
                }
                Event::Eof => return Ok(Item::End(self.depth == 0)),
                _ => {}
            }
        }
    }

    /// A text that is cut off within a tag ends there; all else is an error.
    fn broken(&mut self, cause: &quick_xml::Error) -> Result<Item, TrafficError> {
        let is_at_end = self.reader.get_mut().fill_buf().is_ok_and(<[u8]>::is_empty);
        if matches!(cause, quick_xml::Error::Syntax(_)) && is_at_end && self.depth > 0 {
            return Ok(Item::End(false));
        }
        Err(TrafficError::Xml { line: self.reader.get_ref().n_lines, cause: cause.to_string() })
    }
}

fn element(start: &BytesStart<'_>, line: u64) -> Result<Element, String> {
    let name = start.name();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|cause| cause.to_string())?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|cause| cause.to_string())?;
        attributes.push((text(attribute.key.as_ref().as_bytes()), value.into_owned()));
    }
    Ok(Element { name: text(name.as_ref().as_bytes()), attributes, line })
}

impl Element {
    /// An attribute.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// An attribute that is not empty.
    pub(super) fn text(&self, name: &str, expected: &'static str) -> Result<&str, TrafficError> {
        let text = self.attribute(name).filter(|text| !text.is_empty());
        text.ok_or_else(|| self.wrong(name, expected))
    }

    /// A number for which `ok` holds.
    pub(super) fn number(
        &self,
        name: &str,
        expected: &'static str,
        ok: impl Fn(f64) -> bool,
    ) -> Result<f64, TrafficError> {
        let number =
            self.attribute(name).and_then(|text| text.trim().parse().ok()).filter(|value| ok(*value));
        number.ok_or_else(|| self.wrong(name, expected))
    }

    /// The error of an attribute.
    pub(super) fn wrong(&self, name: &str, expected: &'static str) -> TrafficError {
        TrafficError::Value {
            line: self.line,
            column: format!("{} of <{}>", name, self.name),
            part: Part::Attribute,
            value: self.attribute(name).unwrap_or_default().to_owned(),
            expected,
        }
    }
}

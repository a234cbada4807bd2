//! Lines of a table: all of them end alike, so that they can be counted.

use std::io::{self, Read};

/// Reads a text whose lines end in `\n`, `\r\n` or `\r` as one whose lines end in `\n`, the last one, too.
///
/// Readers of CSV count what they have consumed; what stands between two rows (the rest of an end of line, empty lines) belongs
/// to neither, and shifts the numbers.
#[derive(Debug)]
pub struct Newlines<R> {
    inner: R,
    /// The last byte that was read.
    last: Option<u8>,
}

impl<R> Newlines<R> {
    /// Of this text.
    pub const fn of(inner: R) -> Self {
        Self { inner, last: None }
    }

    /// Converts these bytes where they are; how many are left.
    fn convert(&mut self, bytes: &mut [u8]) -> usize {
        let mut left = 0;
        for place in 0..bytes.len() {
            let byte = bytes[place];
            let is_rest = byte == b'\n' && self.last == Some(b'\r');
            self.last = Some(byte);
            if !is_rest {
                bytes[left] = if byte == b'\r' { b'\n' } else { byte };
                left += 1;
            }
        }
        left
    }
}

impl<R: Read> Read for Newlines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let n = self.inner.read(buffer)?;
            if n == 0 {
                let is_open = !matches!(self.last, None | Some(b'\n' | b'\r'));
                let Some(first) = buffer.first_mut().filter(|_| is_open) else { return Ok(0) };
                (*first, self.last) = (b'\n', Some(b'\n'));
                return Ok(1);
            }
            let left = self.convert(&mut buffer[..n]);
            if left > 0 {
                return Ok(left);
            }
        }
    }
}

/// The line on which the record begins that was read last, counted from 1.
pub fn line_of<R: Read>(reader: &csv::Reader<Newlines<R>>, record: &csv::StringRecord) -> u64 {
    // The reader stands behind the end of the record's last line.
    let within = record.as_slice().bytes().filter(|byte| *byte == b'\n').count() as u64;
    reader.position().line().saturating_sub(1 + within)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a byte at a time.
    struct Slowly<'a>(&'a [u8]);

    impl Read for Slowly<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let n = buffer.len().min(1);
            self.0.read(&mut buffer[..n])
        }
    }

    #[test]
    fn all_lines_end_alike_in_however_small_parts_the_text_comes() {
        for (text, expected) in [
            ("a\r\nb\r\n", "a\nb\n"),
            ("a\rb\r\r\n\nc", "a\nb\n\n\nc\n"),
            ("a\n\r\n", "a\n\n"),
            ("\r\n", "\n"),
            ("", ""),
        ] {
            let (mut whole, mut slow) = (String::new(), String::new());
            Newlines::of(text.as_bytes()).read_to_string(&mut whole).unwrap();
            Newlines::of(Slowly(text.as_bytes())).read_to_string(&mut slow).unwrap();
            assert_eq!((whole.as_str(), slow.as_str()), (expected, expected), "{text:?}");
        }
    }

    #[test]
    fn a_record_has_the_number_of_its_line_behind_any_end_of_line_and_empty_lines() {
        for text in ["a,b\n1,x\n\n2,\"y\nz\"\n3,w", "a,b\r\n1,x\r\n\r\n2,\"y\r\nz\"\r\n3,w\r\n"] {
            let mut reader = csv::Reader::from_reader(Newlines::of(text.as_bytes()));
            let (mut record, mut lines) = (csv::StringRecord::new(), Vec::new());
            while reader.read_record(&mut record).unwrap() {
                lines.push((record[0].to_owned(), line_of(&reader, &record)));
            }
            let expected = [("1", 2), ("2", 4), ("3", 6)].map(|(cell, line)| (cell.to_owned(), line));
            assert_eq!(lines, expected, "{text:?}");
        }
    }
}

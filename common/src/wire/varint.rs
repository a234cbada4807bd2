//! postcard's integers, texts and bytes, read and written without serde: fields in a row are all that frames
//! need.
//!
//! An unsigned integer is its groups of 7 bits, lowest first, each but the last with its top bit set. A
//! signed one is folded first: 0, -1, 1, -2, … A text is its length and its bytes.
//!
//! All is inlined, by force where the compiler would not: then what is left of the bytes stays in registers.

use postcard::Error;

/// Most bytes of an integer of 16 bits.
pub(super) const MAX_LEN_16: usize = 3;
/// Most bytes of an integer of 32 bits.
pub(super) const MAX_LEN_32: usize = 5;
/// Most bytes of an integer of 64 bits.
pub(super) const MAX_LEN_64: usize = 10;

/// Writes into room that was made before: no growing in between.
pub(super) struct Writer<'a> {
    room: &'a mut [u8],
}

/// Appends what `write` writes, at most `room` bytes; where it fails, the buffer is as it was.
#[inline]
pub(super) fn append<T, E>(
    buffer: &mut Vec<u8>,
    room: usize,
    write: impl FnOnce(&mut Writer<'_>) -> Result<T, E>,
) -> Result<T, E> {
    let start = buffer.len();
    buffer.resize(start + room, 0);
    let mut writer = Writer { room: &mut buffer[start..] };
    let outcome = write(&mut writer);
    let n_written = if outcome.is_ok() { room - writer.room.len() } else { 0 };
    buffer.truncate(start + n_written);
    outcome
}

impl Writer<'_> {
    #[inline(always)]
    pub(super) fn bytes<const N: usize>(&mut self, bytes: [u8; N]) {
        let room = std::mem::take(&mut self.room).split_first_chunk_mut();
        let (place, room) = room.expect("room for the longest numbers");
        *place = bytes;
        self.room = room;
    }

    pub(super) fn text(&mut self, text: &str) {
        self.u64(text.len() as u64);
        let (place, room) = std::mem::take(&mut self.room).split_at_mut(text.len());
        place.copy_from_slice(text.as_bytes());
        self.room = room;
    }

    #[inline(always)]
    pub(super) fn u16(&mut self, value: u16) {
        self.u64(u64::from(value));
    }

    #[inline(always)]
    pub(super) fn u32(&mut self, value: u32) {
        self.u64(u64::from(value));
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "of a group the low 7 bits count")]
    pub(super) fn u64(&mut self, value: u64) {
        let group = |place: u32| (value >> (7 * place)) as u8;
        let more = |place| group(place) | 0x80;
        if value < 1 << 7 {
            self.bytes([group(0)]);
        } else if value < 1 << 14 {
            self.bytes([more(0), group(1)]);
        } else if value < 1 << 21 {
            self.bytes([more(0), more(1), group(2)]);
        } else {
            self.room = write_long(std::mem::take(&mut self.room), value);
        }
    }

    #[inline(always)]
    pub(super) fn i16(&mut self, value: i16) {
        self.u16((value << 1 ^ value >> 15).cast_unsigned());
    }

    #[inline(always)]
    pub(super) fn i32(&mut self, value: i32) {
        self.u32((value << 1 ^ value >> 31).cast_unsigned());
    }

    #[inline(always)]
    pub(super) fn i64(&mut self, value: i64) {
        self.u64((value << 1 ^ value >> 63).cast_unsigned());
    }
}

/// An integer of more than three groups; gives the room behind it. Not a method: a writer that no call can
/// touch stays in registers.
#[expect(clippy::cast_possible_truncation, reason = "of a group the low 7 bits count")]
fn write_long(room: &mut [u8], value: u64) -> &mut [u8] {
    let (mut rest, mut len) = (value, 0);
    while rest >= 0x80 {
        room[len] = rest as u8 | 0x80;
        rest >>= 7;
        len += 1;
    }
    room[len] = rest as u8;
    &mut room[len + 1..]
}

/// Reads off the front of the bytes.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl<'a> Reader<'a> {
    #[inline(always)]
    pub(super) fn bytes<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or(Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        Ok(*bytes)
    }

    #[inline(always)]
    pub(super) fn text(&mut self) -> Result<&'a str, Error> {
        let len = usize::try_from(self.u64()?).map_err(|_| Error::DeserializeBadVarint)?;
        let (text, rest) = self.0.split_at_checked(len).ok_or(Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        std::str::from_utf8(text).map_err(|_| Error::DeserializeBadUtf8)
    }

    #[inline(always)]
    pub(super) fn u16(&mut self) -> Result<u16, Error> {
        if let Some(&[a, b, c]) = self.0.first_chunk() {
            let low = u16::from(a & 0x7f) | u16::from(b & 0x7f) << 7;
            let (value, len) = match (a < 0x80, b < 0x80, c <= 0b11) {
                (true, ..) => (u16::from(a), 1),
                (_, true, _) => (low, 2),
                (.., true) => (low | u16::from(c) << 14, 3),
                _ => return Err(Error::DeserializeBadVarint),
            };
            self.0 = &self.0[len..];
            return Ok(value);
        }
        self.long(MAX_LEN_16, 0b11)
    }

    #[inline(always)]
    pub(super) fn u32(&mut self) -> Result<u32, Error> {
        if let Some(word) = self.word() {
            return Ok(word);
        }
        self.long(MAX_LEN_32, 0b1111)
    }

    #[inline(always)]
    pub(super) fn u64(&mut self) -> Result<u64, Error> {
        if let Some(word) = self.word() {
            return Ok(u64::from(word));
        }
        self.long(MAX_LEN_64, 0b1)
    }

    #[inline(always)]
    pub(super) fn i16(&mut self) -> Result<i16, Error> {
        self.u16().map(|folded| (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline(always)]
    pub(super) fn i32(&mut self) -> Result<i32, Error> {
        self.u32().map(|folded| (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline(always)]
    pub(super) fn i64(&mut self) -> Result<i64, Error> {
        self.u64().map(|folded| (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    /// An integer of at most four groups, where that many bytes are left.
    #[inline(always)]
    fn word(&mut self) -> Option<u32> {
        let word = u32::from_le_bytes(*self.0.first_chunk()?);
        let group = |place: u32| (word >> place) & 0x7f << (7 * place);
        let (value, len) = if word & 0x80 == 0 {
            (group(0), 1)
        } else if word & 0x8000 == 0 {
            (group(0) | group(1), 2)
        } else if word & 0x80_0000 == 0 {
            (group(0) | group(1) | group(2), 3)
        } else if word & 0x8000_0000 == 0 {
            (group(0) | group(1) | group(2) | group(3), 4)
        } else {
            return None;
        };
        self.0 = &self.0[len..];
        Some(value)
    }

    #[inline(always)]
    fn long<T: TryFrom<u64>>(&mut self, max_len: usize, last: u8) -> Result<T, Error> {
        let (value, rest) = read_long(self.0, max_len, last)?;
        self.0 = rest;
        T::try_from(value).map_err(|_| Error::DeserializeBadVarint)
    }
}

/// An integer of at most so many groups, of which the last holds at most `last`. Groups of zeros are let
/// pass, as postcard does.
fn read_long(bytes: &[u8], max_len: usize, last: u8) -> Result<(u64, &[u8]), Error> {
    let mut value = 0;
    for place in 0..max_len {
        let byte = *bytes.get(place).ok_or(Error::DeserializeUnexpectedEnd)?;
        value |= u64::from(byte & 0x7f) << (7 * place);
        if byte < 0x80 {
            if place == max_len - 1 && byte > last {
                break;
            }
            return Ok((value, &bytes[place + 1..]));
        }
    }
    Err(Error::DeserializeBadVarint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    type Fields = (u16, u32, u64, i16, i32, i64, String, [u8; 2]);

    /// Integers of every length.
    fn bits() -> impl Strategy<Value = u64> {
        (any::<u64>(), 0..64u32).prop_map(|(bits, shift)| bits >> shift)
    }

    fn written(fields: &Fields) -> Vec<u8> {
        let mut buffer = vec![7; 3];
        let room = 2 * (MAX_LEN_16 + MAX_LEN_32 + MAX_LEN_64) + MAX_LEN_64 + fields.6.len() + 2;
        let write = |writer: &mut Writer<'_>| {
            writer.u16(fields.0);
            writer.u32(fields.1);
            writer.u64(fields.2);
            writer.i16(fields.3);
            writer.i32(fields.4);
            writer.i64(fields.5);
            writer.text(&fields.6);
            writer.bytes(fields.7);
            Ok::<_, ()>(())
        };
        append(&mut buffer, room, write).unwrap();
        assert_eq!(buffer[..3], [7; 3]);
        buffer.split_off(3)
    }

    fn read(bytes: &[u8]) -> Result<(Fields, usize), Error> {
        let mut reader = Reader(bytes);
        let integers =
            (reader.u16()?, reader.u32()?, reader.u64()?, reader.i16()?, reader.i32()?, reader.i64()?);
        let (a, b, c, d, e, f) = integers;
        let fields = (a, b, c, d, e, f, reader.text()?.to_owned(), reader.bytes()?);
        Ok((fields, reader.0.len()))
    }

    fn read_by_postcard(bytes: &[u8]) -> Result<(Fields, usize), Error> {
        let (fields, rest) = postcard::take_from_bytes(bytes)?;
        Ok((fields, rest.len()))
    }

    #[test]
    fn what_fails_leaves_the_buffer_as_it_was() {
        let mut buffer = vec![1, 2];
        let write = |writer: &mut Writer<'_>| {
            writer.u16(3);
            Err::<(), _>("no")
        };
        assert_eq!(append(&mut buffer, MAX_LEN_16, write), Err("no"));
        assert_eq!(buffer, [1, 2]);
    }

    #[test]
    fn every_integer_of_16_bits_is_as_postcard_writes_it() {
        for value in 0..=u16::MAX {
            let fields = (value, 0, 0, value.cast_signed(), 0, 0, String::new(), [0; 2]);
            assert_eq!(written(&fields), postcard::to_stdvec(&fields).unwrap());
        }
    }

    proptest! {
        #[test]
        fn fields_are_as_postcard_writes_them(integers in prop::array::uniform6(bits()), text in ".{0,40}", end in any::<[u8; 2]>()) {
            let [a, b, c, d, e, f] = integers;
            let fields = (a as u16, b as u32, c, d as i16, e as i32, f as i64, text, end);
            let bytes = written(&fields);
            prop_assert_eq!(&bytes, &postcard::to_stdvec(&fields).unwrap());
            prop_assert_eq!(read(&bytes), Ok((fields, 0)));
        }

        /// Mostly long groups, and a length of text within reach.
        #[test]
        fn any_bytes_are_read_or_refused_as_by_postcard(bytes in vec(prop_oneof![any::<u8>(), Just(0x80), Just(0xff), 0..4u8], 0..60)) {
            prop_assert_eq!(read(&bytes), read_by_postcard(&bytes));
        }
    }
}

//! What a hostile program makes of bytes that were right.

use super::dice::Dice;

/// Bytes at which lengths and flags change their meaning.
const BYTES: [u8; 8] = [0, 1, 0x7f, 0x80, 0x81, 0xfe, 0xff, b'"'];
/// In place of a value of JSON.
const VALUES: [&str; 18] = [
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"x\"",
    "-1",
    "0",
    "1e308",
    "-1e308",
    "1e400",
    "1e-320",
    "NaN",
    "-0.0",
    "18446744073709551616",
    "9223372036854775807",
    "[[[[[[[[1]]]]]]]]",
    "\"\\ud800\"",
];
/// Longer ones say nothing new.
const LONGEST: usize = 20_000;

/// Changes the bytes in one to three ways; `others` are right ones of which a part may be taken.
pub(super) fn mutate(bytes: &mut Vec<u8>, is_json: bool, others: &[Vec<u8>], dice: &mut Dice) {
    for _ in 0..1 + dice.below(3) {
        if is_json && dice.happens(0.85) {
            change_value(bytes, dice);
        } else {
            change_bytes(bytes, others, dice);
        }
    }
    bytes.truncate(LONGEST);
}

fn change_bytes(bytes: &mut Vec<u8>, others: &[Vec<u8>], dice: &mut Dice) {
    let length = bytes.len();
    let place = dice.below(length + 1);
    let some = |dice: &mut Dice| dice.below(1 + length.min(32));
    match dice.below(8) {
        0 if place < length => bytes[place] ^= 1 << dice.below(8),
        1 if place < length => bytes[place] = *dice.of(&BYTES),
        2 => bytes.truncate(place),
        3 => {
            let end = (place + some(dice)).min(length);
            bytes.drain(place..end);
        }
        4 => {
            let end = (place + some(dice)).min(length);
            let part = bytes[place..end].to_vec();
            bytes.splice(place..place, part);
        }
        5 => {
            let random: Vec<_> = (0..some(dice)).map(|_| (dice.number() & 0xff) as u8).collect();
            bytes.splice(place..place, random);
        }
        6 if !others.is_empty() => {
            let other = dice.of(others);
            let from = dice.below(other.len() + 1);
            bytes.truncate(place);
            bytes.extend_from_slice(&other[from..]);
        }
        // A number of many bytes in place of one.
        _ => {
            let many = vec![0xff; 1 + dice.below(10)];
            bytes.splice(place..place, many);
        }
    }
}

/// Another value in place of a number, a text or a word; or a key that comes twice.
fn change_value(bytes: &mut Vec<u8>, dice: &mut Dice) {
    let is_simple = |at: &usize| bytes.get(at + 1).is_some_and(|next| !matches!(next, b'{' | b'['));
    let colons: Vec<_> = (0..bytes.len()).filter(|at| bytes[*at] == b':').filter(is_simple).collect();
    if colons.is_empty() {
        return change_bytes(bytes, &[], dice);
    }
    let begin = *dice.of(&colons) + 1;
    let is_end = |byte: &u8| matches!(byte, b',' | b'}' | b']');
    let end = begin + bytes[begin..].iter().position(is_end).unwrap_or(bytes.len() - begin);
    if dice.happens(0.8) {
        bytes.splice(begin..end, dice.of(&VALUES).bytes());
        return;
    }
    // From the key's quotation mark to the end of the value.
    let key = bytes[..begin - 1].iter().rposition(|byte| matches!(byte, b',' | b'{')).map_or(0, |at| at + 1);
    let mut again = bytes[key..end].to_vec();
    again.push(b',');
    bytes.splice(key..key, again);
}

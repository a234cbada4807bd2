//! Places in lists as 32-bit numbers.

/// No place.
pub(super) const NONE: u32 = u32::MAX;

pub(super) fn as_u32(place: usize) -> u32 {
    u32::try_from(place).expect("numbered in 32 bits")
}

pub(super) fn as_index(place: u32) -> u16 {
    u16::try_from(place).expect("validated frames hold at most 4096 detections")
}

pub(super) fn length<T>(list: &[T]) -> u32 {
    as_u32(list.len())
}

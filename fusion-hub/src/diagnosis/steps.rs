//! Which places of two frames of one agent are of one object: those that are the nearest to each other by far. And how fast it moves
//! that is so found in three frames, in a straight line and at one speed.
//!
//! In a row of parked cars, of which each is missed at times, the nearest one is another car, but not twice in a row.

/// Nothing is faster, m/s.
const FASTEST_MPS: f64 = 45.0;
/// The next one must be so many times as far as the nearest one, and so much further, m.
const CLEAR_TIMES: f64 = 1.5;
const CLEAR_M: f64 = 2.0;
/// Both steps have one velocity within such a share of it, and this, m/s.
const STEADY_SHARE: f64 = 0.3;
const STEADY_MPS: f64 = 1.5;

/// The velocity (m/s) of the place `k` of the second of three frames, so many seconds apart each, where it is clear which one is its own
/// in the others, and all three are on a straight line at one speed.
pub(super) fn velocity(k: usize, frames: [&[[f64; 2]]; 3], steps_s: [f64; 2]) -> Option<[f64; 2]> {
    velocity_up_to(FASTEST_MPS, k, frames, steps_s)
}

/// The same of what may be so fast, m/s.
pub(super) fn velocity_up_to(
    fastest_mps: f64,
    k: usize,
    frames: [&[[f64; 2]]; 3],
    steps_s: [f64; 2],
) -> Option<[f64; 2]> {
    let [was, is] = found(fastest_mps, k, frames, steps_s)?;
    steady([frames[0][was], frames[1][k], frames[2][is]], steps_s)
}

/// Which places of the first and of the third of three frames are of the same object as the place `k` of the second one.
pub(super) fn counterparts(k: usize, frames: [&[[f64; 2]]; 3], steps_s: [f64; 2]) -> Option<[usize; 2]> {
    found(FASTEST_MPS, k, frames, steps_s)
}

fn found(fastest_mps: f64, k: usize, frames: [&[[f64; 2]]; 3], steps_s: [f64; 2]) -> Option<[usize; 2]> {
    let [before, own, after] = frames;
    let was = counterpart(k, (own, before), fastest_mps * steps_s[0])?;
    let is = counterpart(k, (own, after), fastest_mps * steps_s[1])?;
    Some([was, is])
}

/// The one place of another frame that can be of the same object: the nearest, by far, and the other way round.
fn counterpart(k: usize, (own, other): (&[[f64; 2]], &[[f64; 2]]), reach_m: f64) -> Option<usize> {
    let found = nearest(own[k], other, reach_m)?;
    (nearest(other[found], own, reach_m)? == k).then_some(found)
}

/// The nearest place within reach, where the next one is much further.
fn nearest(from: [f64; 2], among: &[[f64; 2]], reach_m: f64) -> Option<usize> {
    let mut best: [Option<(f64, usize)>; 2] = [None; 2];
    for (n, other) in among.iter().enumerate() {
        let apart_m = libm::hypot(other[0] - from[0], other[1] - from[1]);
        if best[0].is_none_or(|(least_m, _)| apart_m < least_m) {
            best = [Some((apart_m, n)), best[0]];
        } else if best[1].is_none_or(|(second_m, _)| apart_m < second_m) {
            best[1] = Some((apart_m, n));
        }
    }
    let (least_m, found) = best[0]?;
    let is_clear = best[1]
        .is_none_or(|(second_m, _)| second_m >= CLEAR_TIMES * least_m && second_m >= least_m + CLEAR_M);
    (is_clear && least_m <= reach_m).then_some(found)
}

/// The velocity of what was at three places, m/s; `None` of what does not move steadily.
fn steady(places: [[f64; 2]; 3], steps_s: [f64; 2]) -> Option<[f64; 2]> {
    let step = |k: usize| [0, 1].map(|axis| (places[k + 1][axis] - places[k][axis]) / steps_s[k]);
    let (first, second) = (step(0), step(1));
    let whole = [0, 1].map(|axis| (places[2][axis] - places[0][axis]) / (steps_s[0] + steps_s[1]));
    let differ = libm::hypot(first[0] - second[0], first[1] - second[1]);
    (differ <= STEADY_SHARE * libm::hypot(whole[0], whole[1]) + STEADY_MPS).then_some(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_alone_has_its_velocity_and_what_is_one_of_a_row_has_none() {
        let at = |t_s: f64| [[10.0 * t_s, 0.0], [50.0, 5.0]];
        let frames = [at(0.0), at(0.4), at(0.8)];
        let of = |k: usize| velocity(k, frames.each_ref().map(|one| &one[..]), [0.4; 2]);
        let moving = of(0).unwrap();
        assert!((moving[0] - 10.0).abs() < 1e-9 && moving[1].abs() < 1e-9);
        assert_eq!(of(1), Some([0.0; 2]));
        // A queue that rolls: which one is which cannot be seen.
        let queue = |t_s: f64| [0.0, 6.0, 12.0, 18.0].map(|x| [x + 8.0 * t_s, 0.0]);
        let frames = [queue(0.0), queue(0.4), queue(0.8)];
        assert!((0..4).all(|k| velocity(k, frames.each_ref().map(|one| &one[..]), [0.4; 2]).is_none()));
        // What turns or brakes hard, and what is not there twice.
        assert_eq!(velocity(0, [&[[0.0, 0.0]], &[[4.0, 0.0]], &[[4.0, 4.0]]], [0.4; 2]), None);
        assert_eq!(velocity(0, [&[], &[[4.0, 0.0]], &[[8.0, 0.0]]], [0.4; 2]), None);
    }
}

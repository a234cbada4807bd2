//! Smoothing of the four models: past states, given later ones.
//!
//! Each past model is retrodicted from each of the models that could follow it (Rauch,
//! Tung & Striebel 1965), weighed by how probable that change of model was, and mixed again (Kim 1994; Koch 2000).

use super::gaussian::{self, Full, Gaussian, Still, YAW, apart, at};
use super::model::{MANOEUVRE, PARKED, SMOOTH, STOPPED};
use super::motion::{cross_covariance, moved};
use super::passage::{MOST_STEPS, Passage};
use super::{Imm, mixing, output};
use crate::filter::retrodiction::{Later, Square, retrodicted};
use v2x_common::class::Class;

impl Imm {
    /// The models, given the smoothed state `later`, `dt_s` seconds after them, where nothing was reported in
    /// between; the arguments are those of [`Self::predict`].
    #[must_use]
    pub fn smoothed(&self, (dt_s, class, length_m): (f64, Class, f64), later: &Self) -> Self {
        let passage = Passage::of(dt_s, class, length_m);
        let mut passed = [*self; MOST_STEPS as usize];
        let mut state = *self;
        for before in passed.iter_mut().take(passage.n_steps as usize) {
            *before = state;
            state.pass(&passage);
        }
        let steps = passed.iter().take(passage.n_steps as usize).rev();
        steps.fold(*later, |later, before| before.step_back(&passage, &later))
    }

    /// The models before one step, given the smoothed models after it.
    fn step_back(&self, passage: &Passage, later: &Self) -> Self {
        let sources = match passage.transitions {
            Some(_) => self.sources(passage.params),
            None => [
                self.parked.with_motion(&passage.params.start),
                self.stopped.with_motion(&passage.params.start),
                self.smooth.with_turn(0.0),
                self.manoeuvre,
            ],
        };
        let weights = self.changes(passage, later);
        let mut smoothed = Self { lever_m: later.lever_m, ..*self };
        smoothed.weights = weights.map(|of_model| of_model.iter().sum());
        for (from, weights) in weights.iter().enumerate() {
            let source = &sources[from];
            let pairs: [Full; 4] = std::array::from_fn(|to| {
                if weights[to] > 0.0 { retrodicted_from(source, (from, to), passage, later) } else { *source }
            });
            let own = output::likeliest(weights);
            match from {
                PARKED => mix_into(&mut smoothed.parked, &pairs, own, weights),
                STOPPED => mix_into(&mut smoothed.stopped, &pairs, own, weights),
                SMOOTH => mix_into(&mut smoothed.smooth, &pairs, own, weights),
                _ => mix_into(&mut smoothed.manoeuvre, &pairs, own, weights),
            }
        }
        smoothed.smooth.limit();
        smoothed.manoeuvre.limit();
        smoothed
    }

    /// Smoothed probabilities of each change of model (from row to column) in a step.
    fn changes(&self, passage: &Passage, later: &Self) -> [[f64; 4]; 4] {
        let Some(transitions) = &passage.transitions else {
            return std::array::from_fn(|from| {
                std::array::from_fn(|to| if from == to { later.weights[to] } else { 0.0 })
            });
        };
        let mut joint = [[0.0; 4]; 4];
        for to in 0..4 {
            let into: [f64; 4] = std::array::from_fn(|from| self.weights[from] * transitions[from][to]);
            let sum: f64 = into.iter().sum();
            if sum > 0.0 {
                for from in 0..4 {
                    joint[from][to] = later.weights[to] * into[from] / sum;
                }
            }
        }
        joint
    }
}

fn mix_into<const N: usize, const T: usize>(
    model: &mut Gaussian<N, T>,
    pairs: &[Full; 4],
    own: usize,
    weights: &[f64; 4],
) {
    *model = mixing::mixed(pairs, own, weights, model);
}

/// One model's smoothed state before a step in which it became another one.
fn retrodicted_from(source: &Full, (from, to): (usize, usize), passage: &Passage, later: &Imm) -> Full {
    let found = match to {
        PARKED => retrodicted_from_still(source, passage, &later.parked),
        STOPPED => retrodicted_from_still(source, passage, &later.stopped),
        SMOOTH => {
            let start = source.narrowed::<4, 10>().with_turn(0.0);
            let predicted = moved(&start, &passage.step, &passage.params.smooth).narrowed::<4, 10>();
            let cross = cross_covariance(&start, &passage.step);
            let cross: [[f64; 4]; 4] = std::array::from_fn(|row| leading(&cross[row]));
            let before = dense(&start.narrowed::<4, 10>());
            let found = retrodicted(&before, &cross, known(&predicted, &later.smooth).as_later());
            if from == MANOEUVRE {
                found.and_then(|found| with_turn_of(source, &before, &found))
            } else {
                found.map(widened)
            }
        }
        _ => {
            let predicted = moved(source, &passage.step, &passage.params.manoeuvre);
            let cross = cross_covariance(source, &passage.step);
            retrodicted(&dense(source), &cross, known(&predicted, &later.manoeuvre).as_later())
        }
    };
    // A predicted covariance that is singular in f64 gives no evidence of the past.
    found.map_or(*source, |found| shifted(source, &found))
}

fn retrodicted_from_still(source: &Full, passage: &Passage, later: &Still) -> Option<([f64; 5], Square<5>)> {
    let mut predicted = source.narrowed::<3, 6>();
    passage.params.still.diffuse(&mut predicted, passage.step.duration_s);
    let covariance = dense(source);
    let cross = covariance.map(|row| leading(&row));
    retrodicted(&covariance, &cross, known(&predicted, later).as_later())
}

/// The turn rate is corrected by its covariance with the other components.
fn with_turn_of(
    source: &Full,
    before: &Square<4>,
    (shift, covariance): &([f64; 4], Square<4>),
) -> Option<([f64; 5], Square<5>)> {
    let whole = dense(source);
    let cross = whole.map(|row| leading(&row));
    retrodicted(&whole, &cross, Later { predicted: before, shift, covariance })
}

fn leading<const N: usize>(row: &[f64; 5]) -> [f64; N] {
    std::array::from_fn(|column| row[column])
}

fn widened((shift, covariance): ([f64; 4], Square<4>)) -> ([f64; 5], Square<5>) {
    let entry = |row: usize, column: usize| if row.max(column) < 4 { covariance[row][column] } else { 0.0 };
    let [x, y, yaw, speed] = shift;
    ([x, y, yaw, speed, 0.0], std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column))))
}

/// What [`Later`] refers to.
struct Known<const N: usize> {
    predicted: Square<N>,
    shift: [f64; N],
    covariance: Square<N>,
}

impl<const N: usize> Known<N> {
    fn as_later(&self) -> Later<'_, N> {
        Later { predicted: &self.predicted, shift: &self.shift, covariance: &self.covariance }
    }
}

fn known<const N: usize, const T: usize>(predicted: &Gaussian<N, T>, later: &Gaussian<N, T>) -> Known<N> {
    let mut shift: [f64; N] = std::array::from_fn(|i| later.mean[i] - predicted.mean[i]);
    shift[0] = apart(shift[0]);
    shift[1] = apart(shift[1]);
    shift[YAW] = gaussian::wrapped(shift[YAW]);
    Known { predicted: dense(predicted), shift, covariance: dense(later) }
}

fn dense<const N: usize, const T: usize>(state: &Gaussian<N, T>) -> Square<N> {
    std::array::from_fn(|row| std::array::from_fn(|column| state.covariance[at(row, column)]))
}

fn shifted(source: &Full, (shift, covariance): &([f64; 5], Square<5>)) -> Full {
    let mut result = *source;
    for (mean, shift) in result.mean.iter_mut().zip(shift) {
        *mean += shift;
    }
    for (row, entries) in covariance.iter().enumerate() {
        for (column, entry) in entries.iter().enumerate().take(row + 1) {
            result.covariance[at(row, column)] = *entry;
        }
    }
    result.wrap();
    result
}

#[cfg(test)]
mod tests {
    use super::super::Inflation;
    use super::super::tests::{anything, assert_sound, driven, report};
    use super::*;
    use crate::values::Measurement;
    use nalgebra::{SMatrix, SVector};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// The textbook's smoother: gain C = D P⁻¹, with what was predicted, and its covariance D with what was before.
    fn textbook<const N: usize, const T: usize>(
        before: &Gaussian<N, T>,
        cross: &Square<N>,
        (predicted, later): (&Gaussian<N, T>, &Gaussian<N, T>),
    ) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
        let matrix = |entries: &Square<N>| SMatrix::<f64, N, N>::from_fn(|row, column| entries[row][column]);
        let (p, s) = (matrix(&dense(predicted)), matrix(&dense(later)));
        let gain = matrix(cross) * p.try_inverse().unwrap();
        let mean =
            SVector::from(before.mean) + gain * (SVector::from(later.mean) - SVector::from(predicted.mean));
        (mean, matrix(&dense(before)) + gain * (s - p) * gain.transpose())
    }

    fn assert_is<const N: usize, const T: usize>(
        found: &Gaussian<N, T>,
        (mean, covariance): (SVector<f64, N>, SMatrix<f64, N, N>),
    ) {
        assert!((SVector::from(found.mean) - mean).abs().max() < 1e-9, "{found:?} {mean}");
        let found = dense(found);
        let found = SMatrix::<f64, N, N>::from_fn(|row, column| found[row][column]);
        assert!((found - covariance).abs().max() < 1e-9, "{found} {covariance}");
    }

    #[test]
    fn one_model_alone_equals_the_rts_smoother() {
        // Of an immobile class nothing changes its model.
        let (class, dt, length) = (Class::Barrier, 0.2, 0.5);
        for model in [PARKED, SMOOTH, MANOEUVRE] {
            let mut before = driven(6.0, 0.1, 0.4);
            before.weights = std::array::from_fn(|other| f64::from(u8::from(other == model)));
            let passage = Passage::of(dt, class, length);
            let mut predicted = before;
            predicted.predict(dt, class, length);
            let mut later = predicted;
            later.update(&Measurement { class, ..report([1.0, 0.5], 0.45) }, Inflation::NONE);
            let back = before.smoothed((dt, class, length), &later);
            assert_eq!(back.weights, before.weights);
            let of_turn = |state: &Full| cross_covariance(state, &passage.step);
            if model == PARKED {
                let cross = dense(&before.parked);
                assert_is(&back.parked, textbook(&before.parked, &cross, (&predicted.parked, &later.parked)));
            } else if model == SMOOTH {
                let cross = of_turn(&before.smooth.with_turn(0.0));
                let cross = std::array::from_fn(|row| leading(&cross[row]));
                assert_is(&back.smooth, textbook(&before.smooth, &cross, (&predicted.smooth, &later.smooth)));
            } else {
                let cross = of_turn(&before.manoeuvre);
                let ends = (&predicted.manoeuvre, &later.manoeuvre);
                assert_is(&back.manoeuvre, textbook(&before.manoeuvre, &cross, ends));
            }
        }
    }

    #[test]
    fn smoothing_finds_the_start_of_a_motion_earlier_than_filtering() {
        let mut states = vec![driven(0.0, 0.0, 0.0)];
        for step in 1..=15 {
            // 2 m/s² from the second half second on.
            let t = 0.1 * f64::from(step - 5).max(0.0);
            let mut state = states[states.len() - 1];
            state.predict(0.1, Class::Car, 4.5);
            state.update(&report([t * t, 0.0], 0.0), Inflation::NONE);
            states.push(state);
        }
        let back = (8..15)
            .rev()
            .fold(states[15], |later, place| states[place].smoothed((0.1, Class::Car, 4.5), &later));
        let stands = |state: &Imm| state.weights[PARKED] + state.weights[STOPPED];
        assert!(
            stands(&states[8]) > 0.9 && stands(&back) < 0.5,
            "{:?} {:?}",
            states[8].weights,
            back.weights
        );
        let speed = |state: &Imm| state.moments().velocity[0];
        assert!(
            (speed(&back) - 0.6).abs() < 0.5 && speed(&states[8]) < 0.1,
            "{} {}",
            speed(&states[8]),
            speed(&back)
        );
    }

    #[test]
    fn smoothing_keeps_covariances_positive_definite() {
        let mut random = ChaCha8Rng::seed_from_u64(12);
        for _ in 0..5_000 {
            let first = anything(&mut random, [0.0, 0.0]);
            let mut states = vec![(Imm::initial(&first), (0.0, first.class, 1.0))];
            for step in 1..8 {
                let (mut state, _) = states[states.len() - 1];
                let z = anything(&mut random, state.moments().position);
                let passage = (0.15 * f64::from(step % 5), first.class, z.size[1]);
                state.predict(passage.0, passage.1, passage.2);
                state.update(&z, Inflation::NONE);
                states.push((state, passage));
            }
            let (mut later, mut passage) = states[states.len() - 1];
            for (state, before) in states.iter().rev().skip(1) {
                if passage.0 > 0.0 {
                    later = state.smoothed(passage, &later);
                }
                assert_sound(&later);
                passage = *before;
            }
        }
    }
}

//! Many objects, four at a time.

use super::lanes::{self, Move};
use super::params::Params;
use super::{Imm, passage};
use crate::values::LANES;
use v2x_common::class::Class;

/// Moves some objects, each by its own time: those at these places, each of a class.
pub(in crate::filter) fn predict_some<T>(
    all: &mut [T],
    some: &[(usize, Class)],
    by: impl Fn(&T) -> Move,
    object: impl Fn(&mut T) -> &mut Imm,
) {
    for (kind, params) in Params::of_kinds().enumerate() {
        let mut alike = [(0, Move::NONE); LANES];
        let mut n = 0;
        let predict = |all: &mut [T], alike: &[(usize, Move); LANES], n: usize| {
            let mut together = alike.map(|(place, _)| *object(&mut all[place]));
            lanes::predict(&mut together, &alike.map(|(_, by)| by), params);
            for ((place, _), predicted) in alike.iter().zip(together).take(n) {
                *object(&mut all[*place]) = predicted;
            }
        };
        for (place, class) in some.iter().filter(|(_, class)| Params::kind_of(*class) == kind) {
            let by = by(&all[*place]);
            if !passage::is_short(by.dt_s, *class) {
                object(&mut all[*place]).predict(by.dt_s, *class, by.length_m);
                continue;
            }
            alike[n] = (*place, by);
            n += 1;
            if n == LANES {
                predict(all, &alike, n);
                n = 0;
            }
        }
        if n > 0 {
            // Lanes without an object of their own repeat the first one.
            for unused in n..LANES {
                alike[unused] = alike[0];
            }
            predict(all, &alike, n);
        }
    }
}

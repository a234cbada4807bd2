//! Several states together have the bits of one state after the other.

use super::{Due, Filter, Holds, ImmState, State};
use crate::values::{Measurement, PositionInnovation};
use proptest::prelude::*;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::covariance::Velocity;
use v2x_common::detection::HeadingKind;
use v2x_common::time::{Span, Timestamp};

/// An object with a state.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Object<F>(F);

impl<F> Holds<F> for Object<F> {
    fn state(&self) -> &F {
        &self.0
    }

    fn state_mut(&mut self) -> &mut F {
        &mut self.0
    }
}

/// The past of an object: its class and reports, and how long after the last one it is predicted, ms.
#[derive(Clone, Debug)]
struct Past {
    class: Class,
    reports: Vec<(i64, Measurement)>,
    predicted_ms: i64,
    last: Measurement,
}

fn measurements() -> impl Strategy<Value = Measurement> {
    let sigmas = prop_oneof![0.02..2.0_f64, 2.0..60.0];
    let velocity = prop::option::weighted(0.2, ([-20.0..20.0_f64, -20.0..20.0], 0.1..2.0_f64));
    let yaw = prop_oneof![-3.15..3.15_f64, -9.0..9.0];
    (
        ([-40.0..40.0_f64, -40.0..40.0], sigmas),
        yaw,
        [0.5..3.0_f64, 0.5..12.0],
        0.001..2.0_f64,
        (velocity, prop::bool::weighted(0.1)),
    )
        .prop_map(|((position, sigma), yaw, size, yaw_variance, (velocity, is_track))| Measurement {
            class: Class::Car,
            position,
            r: Covariance2 { xx: sigma * sigma, xy: 0.3 * sigma * sigma, yy: 2.0 * sigma * sigma },
            size,
            relative_variance: [0.04; 2],
            size_law: [None; 2],
            heading: HeadingKind::Known,
            yaw,
            yaw_variance,
            velocity: velocity.map(|([x, y], sigma)| Velocity {
                x,
                y,
                covariance: Covariance2::isotropic(sigma),
            }),
            is_track,
            since_last_s: f64::INFINITY,
        })
}

fn pasts() -> impl Strategy<Value = Past> {
    let class = prop::sample::select(vec![
        Class::Car,
        Class::Car,
        Class::Car,
        Class::Adult,
        Class::Barrier,
        Class::Trailer,
    ]);
    // Short and long steps, both ways, and none.
    let predicted_ms = prop_oneof![Just(0), 1..=250_i64, -250..=-1_i64, 251..3000_i64];
    let reports = prop::collection::vec((5..400_i64, measurements()), 1..6);
    (class, reports, predicted_ms, measurements()).prop_map(|(class, reports, predicted_ms, last)| Past {
        class,
        reports,
        predicted_ms,
        last,
    })
}

const AT: Timestamp = Timestamp::EPOCH;

/// The state after the reports, so long before [`AT`] as it is then predicted.
fn state_of<F: Filter>(past: &Past) -> F {
    let whole: i64 = past.reports.iter().skip(1).map(|(ms, _)| ms).sum();
    let mut at = AT - Span::from_millis(whole + past.predicted_ms);
    let mut state = F::initial(at, &Measurement { class: past.class, ..past.reports[0].1 });
    for (ms, z) in &past.reports[1..] {
        at += Span::from_millis(*ms);
        state.predict(at, past.class);
        state.update(&Measurement { class: past.class, ..*z });
    }
    state
}

/// The numbers of a state, with their bits: NaN equals itself, and 0 is not −0.
fn bits<T: std::fmt::Debug>(value: &T) -> String {
    format!("{value:?}")
}

fn assert_same_together<F: Filter>(pasts: &[Past]) {
    let mut objects: Vec<_> = pasts.iter().map(|past| Object(state_of::<F>(past))).collect();
    let mut together: Vec<F> = objects.iter().map(|object| object.0).collect();
    let due = |(place, past): (usize, &Past)| Due { place, class: past.class, to: AT };
    let due: Vec<_> = pasts.iter().enumerate().map(due).collect();
    F::predict_some(&mut together, &due);
    for (object, past) in objects.iter_mut().zip(pasts) {
        object.0.predict(AT, past.class);
    }
    let one_by_one: Vec<F> = objects.iter().map(|object| object.0).collect();
    assert_eq!(bits(&together), bits(&one_by_one), "predicted");

    let mut measured = Vec::new();
    F::predicted_measurements(&together, |place| pasts[place].class, |predicted| measured.push(predicted));
    let expected: Vec<_> =
        together.iter().zip(pasts).map(|(state, past)| state.predicted_measurement(past.class)).collect();
    assert_eq!(bits(&measured), bits(&expected), "as association needs it");

    let mut poses = Vec::new();
    F::poses(&together, |pose| poses.push(pose));
    assert_eq!(bits(&poses), bits(&together.iter().map(F::pose).collect::<Vec<_>>()), "as published");

    let reports: Vec<_> = pasts.iter().map(|past| past.last).enumerate().collect();
    let mut innovations: Vec<Option<PositionInnovation>> = vec![None; pasts.len()];
    let mut updated = objects.clone();
    F::update_some(&mut updated, &reports, |number, innovation| innovations[number] = Some(innovation));
    let expected: Vec<_> =
        objects.iter_mut().zip(&reports).map(|(object, (_, z))| Some(object.0.update(z))).collect();
    assert_eq!(bits(&updated), bits(&objects), "updated");
    assert_eq!(bits(&innovations), bits(&expected), "innovations");
}

proptest! {
    #[test]
    fn states_that_are_computed_together_have_the_bits_of_one_after_the_other(
        pasts in prop::collection::vec(pasts(), 1..14),
    ) {
        assert_same_together::<ImmState>(&pasts);
        assert_same_together::<State>(&pasts);
    }
}

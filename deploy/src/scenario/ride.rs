//! On which vehicle of some traffic an agent rides, and when it is there.

use v2x_agent::trajectories::{RecordedObject, Sample, Traffic};
use v2x_common::class::ClassGroup;
use v2x_common::time::Span;

/// What goes less far stands, m.
const LEAST_WAY_M: f64 = 10.0;
/// What goes at least so far is as good as anything that goes farther, m.
const LONG_WAY_M: f64 = 100.0;
/// A second of waiting for a vehicle costs so many seconds of its presence.
const WAITING: f64 = 0.5;

/// The longest time for which a vehicle is there without a gap, since the beginning of the traffic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stay<'a> {
    pub(super) object: &'a RecordedObject,
    pub(super) from: Span,
    pub(super) to: Span,
    way_m: f64,
}

/// The vehicle that is there long, and early, and goes somewhere.
pub(super) fn best(traffic: &Traffic) -> Option<Stay<'_>> {
    let vehicles = traffic.objects.iter().filter(|object| object.class.group() == ClassGroup::FourWheeled);
    let stays = vehicles.filter_map(|object| longest(object, traffic.max_gap));
    let moving = stays.filter(|stay| stay.way_m > LEAST_WAY_M);
    moving.max_by(|a, b| a.worth().total_cmp(&b.worth()))
}

fn longest(object: &RecordedObject, max_gap: Span) -> Option<Stay<'_>> {
    let stretches = object.trajectory.samples().chunk_by(|before, after| after.t - before.t <= max_gap);
    let stays = stretches.filter_map(|samples: &[Sample]| {
        let (first, last) = (samples.first()?, samples.last()?);
        let steps = samples.windows(2).map(|pair| pair[0].pose.distance_to(pair[1].pose.x, pair[1].pose.y));
        Some(Stay { object, from: first.t, to: last.t, way_m: steps.sum() })
    });
    stays.max_by(|a, b| a.seconds().total_cmp(&b.seconds()))
}

impl Stay<'_> {
    /// How long it is there, s.
    pub(super) fn seconds(&self) -> f64 {
        (self.to - self.from).as_secs_f64()
    }

    fn worth(&self) -> f64 {
        let way = (self.way_m / LONG_WAY_M).min(1.0);
        let worth = self.seconds() - WAITING * self.from.as_secs_f64();
        // Of what comes late, too, that is better which moves more.
        if worth > 0.0 { way * worth } else { worth / way.max(1e-3) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_agent::trajectories::{ReadOptions, read};

    /// A car for each of these times of presence (s), at 8 m/s.
    fn traffic(stays: &[(&str, &[(u32, u32)])]) -> Traffic {
        let mut rows = Vec::new();
        for (id, times) in stays {
            let seconds = times.iter().flat_map(|(from, to)| *from..=*to);
            rows.extend(seconds.map(|t| (t, format!("{t},{id},car,{},0\n", 8 * t))));
        }
        rows.sort();
        let text = rows.into_iter().fold("t,id,class,x,y\n".to_owned(), |text, (_, row)| text + &row);
        read(text.as_bytes(), &ReadOptions::default()).unwrap()
    }

    fn chosen(stays: &[(&str, &[(u32, u32)])]) -> (String, f64, f64) {
        let traffic = traffic(stays);
        let stay = best(&traffic).unwrap();
        (stay.object.name.clone(), stay.from.as_secs_f64(), stay.to.as_secs_f64())
    }

    #[test]
    fn a_vehicle_that_is_there_long_and_early_is_taken_before_one_that_comes_late() {
        assert_eq!(chosen(&[("early", &[(0, 30)]), ("late", &[(40, 75)])]), ("early".to_owned(), 0.0, 30.0));
        assert_eq!(chosen(&[("short", &[(0, 5)]), ("long", &[(6, 60)])]), ("long".to_owned(), 6.0, 60.0));
    }

    #[test]
    fn what_goes_away_and_comes_back_counts_with_its_longest_stay() {
        let (id, from, to) = chosen(&[("gone", &[(0, 10), (40, 60)]), ("stays", &[(2, 30)])]);
        assert_eq!((id.as_str(), from, to), ("stays", 2.0, 30.0));
    }
}

//! Sizes that no objects have.

use v2x_common::class::{Class, ClassGroup};

/// Nothing on a road is wider or longer, or smaller, m.
const MOST_M: [f64; 2] = [4.5, 30.0];
const LEAST_M: f64 = 0.1;
/// Vehicles of which so many are wider than long have both exchanged.
const WIDE_SHARE: f64 = 0.8;
/// Vehicles of which so many are at most, or at least, such a part as wide and as long as their class is, have wrong sizes.
const MOST: f64 = 0.9;
const SMALL: [f64; 2] = [0.67, 0.72];
const LARGE: [f64; 2] = [1.5, 1.5];
/// Fewest rows that say so, and objects.
const MIN_ROWS: u64 = 10;
const MIN_OBJECTS: usize = 2;

/// A size in a row.
#[derive(Clone, Debug)]
struct Odd {
    line: u64,
    id: String,
    size_m: [f64; 2],
}

/// Of a recording.
#[derive(Clone, Debug, Default)]
pub(super) struct Sizes {
    n_odd: u64,
    first_odd: Option<Odd>,
    first_wide: Option<Odd>,
    first: Option<Odd>,
    vehicles: u64,
    /// Wider than long; too small, too large for their class.
    wide: u64,
    small: u64,
    large: u64,
    sums_m: [f64; 2],
    /// Of the areas of their classes.
    typical_m2: f64,
}

impl Sizes {
    /// Takes in the width and the depth of a row, where it says both.
    pub(super) fn note(&mut self, (line, id): (u64, &str), class: Class, size: (Option<f64>, Option<f64>)) {
        let (Some(w), Some(d)) = size else { return };
        let size_m = [w, d];
        let odd = || Odd { line, id: id.to_owned(), size_m };
        if (0..2).any(|k| !(LEAST_M..=MOST_M[k]).contains(&size_m[k])) {
            self.n_odd += 1;
            self.first_odd.get_or_insert_with(odd);
        }
        if class.group() != ClassGroup::FourWheeled {
            return;
        }
        let (typical_w, typical_d) = class.typical_size();
        let parts = [w / typical_w, d / typical_d];
        self.first.get_or_insert_with(odd);
        self.vehicles += 1;
        self.typical_m2 += typical_w * typical_d;
        self.small += u64::from((0..2).all(|k| parts[k] <= SMALL[k]));
        self.large += u64::from((0..2).all(|k| parts[k] >= LARGE[k]));
        self.sums_m = [self.sums_m[0] + w, self.sums_m[1] + d];
        if w > d {
            self.wide += 1;
            self.first_wide.get_or_insert_with(odd);
        }
    }

    /// What looks wrong, of so many objects.
    #[expect(clippy::cast_precision_loss, reason = "numbers of rows")]
    pub(super) fn warnings(&self, n_objects: usize) -> Vec<String> {
        let share = |n: u64| if self.vehicles >= MIN_ROWS { n as f64 / self.vehicles as f64 } else { 0.0 };
        let mut warnings = Vec::new();
        let are_wide = share(self.wide) >= WIDE_SHARE;
        if let Some(wide) = self.first_wide.as_ref().filter(|_| are_wide) {
            warnings.push(format!(
                "{} of {} vehicles are wider than long, the first one in line {} ({}): w is across the heading, and d along it",
                self.wide, self.vehicles, wide.line, wide.words()
            ));
        }
        let is_wrong = share(self.small.max(self.large)) >= MOST && n_objects >= MIN_OBJECTS;
        if let Some(first) = self.first.as_ref().filter(|_| is_wrong) {
            let [w, d] = self.sums_m.map(|sum| sum / self.vehicles as f64);
            let guess = match w * d / self.typical_m2 * self.vehicles as f64 {
                area if area < 1.0 => "are they halves of boxes",
                area if (8.0..14.0).contains(&area) => {
                    "are they in feet, and write metres (· 0.3048), also of x and y"
                }
                area if (70.0..140.0).contains(&area) => "are they in decimetres, as x and y may be, too",
                _ => "are they in metres",
            };
            warnings.push(format!(
                "vehicles are {w:.2} m wide and {d:.2} m long in the mean, too {} for vehicles, the first one in line {} ({}): {guess}?",
                if self.small > self.large { "small" } else { "large" },
                first.line,
                first.words()
            ));
        }
        // What all of them are is said above.
        if let Some(odd) = self.first_odd.as_ref().filter(|_| !is_wrong && !are_wide) {
            warnings.push(format!(
                "{} rows have sizes that nothing on a road has, the first one in line {} ({}): w and d are in metres",
                self.n_odd, odd.line, odd.words()
            ));
        }
        warnings
    }
}

impl Odd {
    fn words(&self) -> String {
        let [w, d] = self.size_m;
        format!("{:?}: {w} m wide, {d} m long", self.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warnings(sizes: &[(Class, f64, f64)]) -> Vec<String> {
        let mut all = Sizes::default();
        for k in 0..20_u64 {
            for (line, (class, w, d)) in (2 + 10 * k..).zip(sizes) {
                all.note((line, "a7"), *class, (Some(*w), Some(*d)));
            }
        }
        all.warnings(sizes.len())
    }

    #[test]
    fn sizes_that_nothing_has_are_named_with_their_line() {
        use Class::{Adult, BendyBus, Bicycle, Car, Truck};
        let one = |sizes: &[(Class, f64, f64)], words: &str| {
            let found = warnings(sizes);
            let [one] = &found[..] else { panic!("{sizes:?}: {found:?}") };
            assert!(one.contains(words) && one.contains("in line "), "{one}");
        };
        one(
            &[(Car, 1.8, 4.5), (Truck, 2.5, 45.0)],
            "the first one in line 3 (\"a7\": 2.5 m wide, 45 m long)",
        );
        one(&[(Car, 1.8, 4.5), (Adult, 0.6, 0.05)], "20 rows have sizes that nothing on a road has");
        one(&[(Car, 0.9, 2.25), (Car, 0.95, 2.4)], "halves of boxes");
        one(&[(Car, 3.6, 9.0), (Car, 3.8, 9.6)], "too large for vehicles");
        one(&[(Car, 18.0, 45.0), (Car, 19.0, 48.0)], "in decimetres");
        one(&[(Car, 5.9, 14.8), (Car, 6.2, 15.1)], "in feet");
        one(&[(Car, 4.5, 1.8), (Truck, 8.0, 2.5)], "wider than long");
        let sound = [
            (Car, 1.8, 4.5),
            (BendyBus, 2.55, 18.7),
            (Truck, 2.6, 25.25),
            (Adult, 0.6, 0.5),
            (Bicycle, 0.6, 1.8),
        ];
        assert_eq!(warnings(&sound), [""; 0]);
        // Small cars, and a single one that is smaller.
        assert_eq!(warnings(&[(Car, 1.5, 2.7), (Car, 1.24, 2.34), (Car, 1.8, 4.5)]), [""; 0]);
        assert_eq!(warnings(&[(Car, 0.9, 2.2)]), [""; 0]);
    }
}

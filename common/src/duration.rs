//! Durations on command lines and in sentences: one spelling for all of them.

/// A text is not a duration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a duration such as 10s, 500ms, 2min or 1h; a plain number is seconds")]
pub struct InvalidDuration;

/// Parses a duration in seconds: the value parser of every such option, whose error `clap` puts behind the option and the value.
pub fn parse_seconds(text: &str) -> Result<f64, InvalidDuration> {
    let split = text.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | 'e')).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit.trim() {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "min" | "m" => 60.0,
        "h" => 3600.0,
        _ => return Err(InvalidDuration),
    };
    let number: f64 = number.trim().parse().map_err(|_| InvalidDuration)?;
    let seconds = number * scale;
    if seconds.is_finite() { Ok(seconds) } else { Err(InvalidDuration) }
}

/// A duration (s) in a sentence, in the largest unit of which it is two or more, so that nobody counts digits: `604800 s` are `7 days`.
pub fn in_words(seconds: f64) -> String {
    const UNITS: [(f64, &str); 4] = [(86_400.0, "days"), (3_600.0, "h"), (60.0, "min"), (1.0, "s")];
    /// From so many seconds on milliseconds are none.
    const SECONDS_FROM: f64 = 10.0;
    let unit = UNITS.into_iter().find(|(of_s, _)| seconds.abs() >= (2.0 * of_s).max(SECONDS_FROM));
    match unit {
        Some((of_s, name)) => {
            let text = format!("{:.1}", seconds / of_s);
            format!("{} {name}", text.strip_suffix(".0").unwrap_or(&text))
        }
        None => format!("{:.0} ms", 1e3 * seconds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_said_in_units_whose_digits_nobody_has_to_count() {
        let cases = [
            (0.331, "331 ms"),
            (3.5, "3500 ms"),
            (12.0, "12 s"),
            (37.04, "37 s"),
            (3_599.969, "60 min"),
            (-7_200.0, "-2 h"),
            (604_800.031, "7 days"),
        ];
        for (seconds, words) in cases {
            assert_eq!(in_words(seconds), words);
        }
    }

    #[test]
    fn durations_are_read_with_their_units() {
        let cases = [
            ("10s", 10.0),
            ("12", 12.0),
            ("0.5", 0.5),
            ("4500ms", 4.5),
            ("2min", 120.0),
            ("1.5 h", 5400.0),
            ("1e2", 100.0),
        ];
        for (text, seconds) in cases {
            assert_eq!(parse_seconds(text), Ok(seconds), "{text}");
        }
    }

    #[test]
    fn what_is_no_duration_is_refused() {
        for text in ["", "s", "10 parsecs", "-5s", "soon", "1.2.3", "nan", "1e999"] {
            assert!(parse_seconds(text).is_err(), "{text}");
        }
    }
}

//! Durations on command lines and in sentences: one spelling for all of them.

/// Units, each with its length (s).
const UNITS: [(&str, f64); 7] =
    [("ms", 1e-3), ("s", 1.0), ("min", 60.0), ("m", 60.0), ("h", 3_600.0), ("d", 86_400.0), ("w", 604_800.0)];

/// Longest time until a further file of a recording begins, s: ten years.
const LONGEST_ROTATION_S: f64 = 3650.0 * 86_400.0;

/// A text is not a duration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a duration such as 10s, 500ms, 2min or 1h; a plain number is {plain}")]
pub struct InvalidDuration {
    /// What a number without a unit is.
    plain: &'static str,
}

/// Parses a duration in seconds: the value parser of every such option, whose error `clap` puts behind the option and the value.
pub fn parse_seconds(text: &str) -> Result<f64, InvalidDuration> {
    not_negative(text, "seconds", 1.0)
}

/// Parses a time before or after another one, in seconds.
pub fn parse_signed_seconds(text: &str) -> Result<f64, InvalidDuration> {
    parse(text, "seconds", 1.0)
}

/// Parses a duration in milliseconds, of an option whose plain number is milliseconds.
pub fn parse_millis(text: &str) -> Result<f64, InvalidDuration> {
    not_negative(text, "milliseconds", 1e-3)
}

/// Parses a duration in minutes, of an option whose plain number is minutes.
pub fn parse_minutes(text: &str) -> Result<f64, InvalidDuration> {
    not_negative(text, "minutes", 60.0)
}

/// Parses a duration in days, of an option whose plain number is days.
pub fn parse_days(text: &str) -> Result<f64, InvalidDuration> {
    not_negative(text, "days", 86_400.0)
}

/// Parses the time (min) after which a further file begins: a second at least, so that a disk is not filled with files.
pub fn parse_rotation(text: &str) -> Result<f64, String> {
    let minutes = parse_minutes(text).map_err(|error| error.to_string())?;
    let is_within = (1.0..=LONGEST_ROTATION_S).contains(&(60.0 * minutes));
    is_within.then_some(minutes).ok_or_else(|| format!("{text} is not within 1s and 10 years"))
}

fn not_negative(text: &str, plain: &'static str, plain_s: f64) -> Result<f64, InvalidDuration> {
    let value = parse(text, plain, plain_s)?;
    if value.is_sign_negative() { Err(InvalidDuration { plain }) } else { Ok(value) }
}

/// A duration in the unit that a plain number has, which is `plain_s` long.
fn parse(text: &str, plain: &'static str, plain_s: f64) -> Result<f64, InvalidDuration> {
    let text = text.trim();
    // A number is taken as it is: no rounding by a change of units.
    let value = text.parse().ok().or_else(|| {
        let split = text.rfind(|c: char| !c.is_ascii_alphabetic())? + 1;
        let (number, unit) = text.split_at_checked(split)?;
        let (_, unit_s) = UNITS.into_iter().find(|(name, _)| *name == unit)?;
        let number: f64 = number.trim().parse().ok()?;
        Some(number * (unit_s / plain_s))
    });
    value.filter(|value: &f64| value.is_finite()).ok_or(InvalidDuration { plain })
}

/// A duration (s) in a sentence, in the largest unit of which it is two or more, so that nobody counts digits: `604800 s` are `7 days`.
pub fn in_words(seconds: f64) -> String {
    const SAID: [(f64, &str); 4] = [(86_400.0, "days"), (3_600.0, "h"), (60.0, "min"), (1.0, "s")];
    /// From so many seconds on milliseconds are none.
    const SECONDS_FROM: f64 = 10.0;
    let unit = SAID.into_iter().find(|(of_s, _)| seconds.abs() >= (2.0 * of_s).max(SECONDS_FROM));
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
    fn a_plain_number_keeps_the_unit_of_its_option_and_a_written_unit_means_the_same_everywhere() {
        assert_eq!(parse_millis("300"), Ok(300.0));
        assert_eq!(parse_minutes("5"), Ok(5.0));
        assert_eq!(parse_days("0.5"), Ok(0.5));
        assert_eq!(parse_signed_seconds("-12.5"), Ok(-12.5));
        assert_eq!(parse_signed_seconds("-2min"), Ok(-120.0));
        for (text, seconds) in
            [("500ms", 0.5), ("12s", 12.0), ("2min", 120.0), ("7d", 604_800.0), ("4w", 2_419_200.0)]
        {
            let parsers = [
                (parse_seconds as fn(&str) -> _, 1.0),
                (parse_millis, 1e-3),
                (parse_minutes, 60.0),
                (parse_days, 86_400.0),
            ];
            for (parser, plain_s) in parsers {
                let found_s: f64 = parser(text).unwrap() * plain_s;
                assert!((found_s - seconds).abs() < 1e-12 * seconds, "{text}: {found_s} s");
            }
        }
        assert!(parse_millis("soon").unwrap_err().to_string().ends_with("a plain number is milliseconds"));
    }

    #[test]
    fn files_rotate_after_a_second_at_the_least() {
        assert_eq!(parse_rotation("60"), Ok(60.0));
        assert_eq!(parse_rotation("90s"), Ok(1.5));
        for wrong in ["0", "500ms", "-5", "1e300", "often"] {
            assert!(parse_rotation(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_no_duration_is_refused() {
        for text in ["", "s", "10 parsecs", "-5s", "soon", "1.2.3", "nan", "1e999"] {
            assert!(parse_seconds(text).is_err(), "{text}");
        }
    }
}

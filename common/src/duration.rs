//! Durations on command lines: one spelling for all of them.

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

#[cfg(test)]
mod tests {
    use super::*;

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

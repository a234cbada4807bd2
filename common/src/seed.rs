//! Seeds of random numbers on command lines.

/// A text is not a seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a whole number from 0 to 18446744073709551615 (2^64 - 1)")]
pub struct InvalidSeed;

/// Parses a seed: the value parser of every `--seed`, whose error `clap` puts behind the option and the value.
pub fn parse_seed(text: &str) -> Result<u64, InvalidSeed> {
    text.parse().map_err(|_| InvalidSeed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_64_bits_is_a_seed() {
        assert_eq!(parse_seed("0"), Ok(0));
        assert_eq!(parse_seed("18446744073709551615"), Ok(u64::MAX));
    }

    #[test]
    fn the_error_says_what_is_expected() {
        for text in ["abc", "-1", "1.5", "", "18446744073709551616"] {
            let message = parse_seed(text).unwrap_err().to_string();
            assert!(message.contains("a whole number from 0 to 18446744073709551615"), "{text}: {message}");
        }
    }
}

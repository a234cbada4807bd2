//! Standard output, whose reader may close it first: `v2x status | head` ends without an error.

use anyhow::Context;
use std::io::{ErrorKind, Write};

/// Whether standard output still has a reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    Open,
    Closed,
}

/// Prints text at once, without a newline of its own.
pub(crate) fn print(text: &str) -> anyhow::Result<Output> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    output(written.context("writing to standard output"))
}

/// What an attempt to print found: an output without a reader is not an error.
pub(crate) fn output(printed: anyhow::Result<()>) -> anyhow::Result<Output> {
    match printed {
        Ok(()) => Ok(Output::Open),
        Err(error) if is_closed(&error) => Ok(Output::Closed),
        Err(error) => Err(error),
    }
}

fn is_closed(error: &anyhow::Error) -> bool {
    let cause = error.root_cause().downcast_ref::<std::io::Error>();
    cause.is_some_and(|cause| cause.kind() == ErrorKind::BrokenPipe)
}

/// A word of a command line that a shell takes as one, to be copied.
pub(crate) fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_with_spaces_is_one_word_of_a_shell_when_it_is_copied() {
        assert_eq!(shell_word("Kreuzung-Süd/mein.toml"), "Kreuzung-Süd/mein.toml");
        for text in ["sub dir/mein verkehr.toml", "", "it's (one) $HOME; *.toml"] {
            let printed = std::process::Command::new("sh")
                .args(["-c", &format!("printf %s {}", shell_word(text))])
                .output();
            assert_eq!(String::from_utf8(printed.unwrap().stdout).unwrap(), text);
        }
    }

    fn failed(kind: ErrorKind) -> anyhow::Result<Output> {
        output(Err(std::io::Error::from(kind)).context("writing the summary"))
    }

    #[test]
    fn only_an_output_without_a_reader_is_no_error() {
        assert_eq!(failed(ErrorKind::BrokenPipe).unwrap(), Output::Closed);
        assert!(failed(ErrorKind::StorageFull).is_err());
        assert_eq!(output(Ok(())).unwrap(), Output::Open);
    }
}

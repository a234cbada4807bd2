//! The answer of a command, on standard output.

use std::io::{ErrorKind, Result, Write};

/// Prints the answer of a command. A reader that has closed its end (`lab … | head`) has read enough: that is no error.
pub(crate) fn print(text: &str) -> Result<()> {
    write_all(&mut std::io::stdout().lock(), text)
}

fn write_all(out: &mut impl Write, text: &str) -> Result<()> {
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Refuses everything with this error.
    struct Refusing(ErrorKind);

    impl Write for Refusing {
        fn write(&mut self, _: &[u8]) -> Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_pipe_is_no_error_and_a_full_disk_is_one() {
        assert!(write_all(&mut Refusing(ErrorKind::BrokenPipe), "text").is_ok());
        assert!(write_all(&mut Refusing(ErrorKind::StorageFull), "text").is_err());
    }
}

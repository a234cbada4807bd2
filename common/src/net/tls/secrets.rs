//! Secrets of configurations never reach the logs, whoever writes them: Zenoh logs its whole configuration at the level debug.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What stands in a log in place of a secret.
const REDACTED: &str = "[redacted]";
/// Shorter ones would take other words with them.
const SHORTEST: usize = 4;

static SECRETS: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn secrets() -> MutexGuard<'static, Vec<String>> {
    // Each change of it is one statement: a poisoned lock is safe to use.
    SECRETS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on this text is left out of everything that is logged.
pub(super) fn conceal(secret: &str) {
    // As it is, and as `{:?}` writes it.
    let quoted = format!("{secret:?}");
    let escaped = quoted.trim_matches('"').to_owned();
    let mut secrets = secrets();
    for text in [secret.to_owned(), escaped] {
        if text.len() >= SHORTEST && !secrets.contains(&text) {
            secrets.push(text);
        }
    }
}

/// The message without secrets, if it has any.
pub(in crate::net) fn redacted(message: &[u8]) -> Option<Vec<u8>> {
    let secrets = secrets();
    if secrets.is_empty() {
        return None;
    }
    let text = std::str::from_utf8(message).ok()?;
    let mut found = secrets.iter().filter(|secret| text.contains(secret.as_str())).peekable();
    found.peek()?;
    Some(found.fold(text.to_owned(), |text, secret| text.replace(secret, REDACTED)).into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concealed_secret_is_left_out_of_a_message_as_it_is_and_as_it_is_quoted() {
        conceal("pass\"word-7");
        let message = format!("user a, {} and {:?}", "pass\"word-7", "pass\"word-7");
        let message = String::from_utf8(redacted(message.as_bytes()).unwrap()).unwrap();
        assert_eq!(message, "user a, [redacted] and \"[redacted]\"");
        assert_eq!(redacted(b"nothing secret"), None);
    }
}

//! Secrets of configurations never reach the logs, whoever writes them: Zenoh logs its whole configuration at the level debug.

use crate::net::endpoint::REDACTED;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Shorter ones would take other words with them.
const SHORTEST: usize = 4;

static SECRETS: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn secrets() -> MutexGuard<'static, Vec<String>> {
    // Each change of it is one statement: a poisoned lock is safe to use.
    SECRETS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on this text is left out of everything that is logged.
pub(super) fn conceal(secret: &str) {
    // As it is, as `{:?}` writes it, and both as a line of JSON holds them.
    let unquoted = |quoted: String| quoted.trim_matches('"').to_owned();
    let plain = [secret.to_owned(), unquoted(format!("{secret:?}"))];
    let in_json = plain.clone().map(|text| unquoted(serde_json::Value::from(text).to_string()));
    let mut secrets = secrets();
    for text in plain.into_iter().chain(in_json) {
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

/// A text, such as an error of Zenoh that quotes endpoints, without secrets.
pub(in crate::net) fn without_secrets(text: &str) -> String {
    let redacted = redacted(text.as_bytes()).and_then(|bytes| String::from_utf8(bytes).ok());
    redacted.unwrap_or_else(|| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concealed_secret_of_tls_is_left_out_of_a_message_as_it_is_and_as_it_is_quoted() {
        conceal("pass\"word-7");
        let message = format!("user a, {} and {:?}", "pass\"word-7", "pass\"word-7");
        let shown = |message: &str| String::from_utf8(redacted(message.as_bytes()).unwrap()).unwrap();
        assert_eq!(shown(&message), "user a, [redacted] and \"[redacted]\"");
        let line = serde_json::json!({ "message": message }).to_string();
        assert_eq!(shown(&line), r#"{"message":"user a, [redacted] and \"[redacted]\""}"#);
        assert_eq!(redacted(b"nothing secret"), None);
    }
}

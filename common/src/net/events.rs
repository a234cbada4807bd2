//! Life-cycle events of a child for its launcher: JSON lines on standard output.

use serde::Serialize;
use std::io::Write;

/// Prints one event, such as `{"event":"ready","locators":[…]}`. It is no error if the launcher has ended.
pub fn emit(event: &str, fields: &impl Serialize) {
    let mut line = serde_json::json!({ "event": event });
    if let (Some(line), Ok(serde_json::Value::Object(fields))) =
        (line.as_object_mut(), serde_json::to_value(fields))
    {
        line.extend(fields);
    }
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}

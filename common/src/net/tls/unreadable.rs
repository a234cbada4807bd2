//! Why a Zenoh configuration cannot be read, without what stands in it.
//!
//! Readers of JSON5 quote the line or the value at which they fail, and Zenoh the whole configuration where one value of it
//! is not allowed: a password or a private key can be in that. Names of keys, places and what was expected are kept.

/// What stands in place of a value.
const LEFT_OUT: &str = "[left out]";
/// After this Zenoh quotes everything.
const WHOLE: &str = "Invalid configuration:";
/// Behind these words serde quotes a value.
const KINDS: [&str; 7] =
    ["string ", "character ", "integer ", "floating point ", "boolean ", "unknown variant ", "byte array "];

/// An error of a reader without the values that it quotes.
pub(in crate::net) fn without_values(message: &str) -> String {
    if let Some((before, _)) = message.split_once(WHOLE) {
        return format!("{before}{WHOLE} a value is outside of what its key allows");
    }
    let (said, place) = unquoted(message);
    let lines = said.lines().filter(|line| !is_excerpt(line)).map(str::trim).filter(|line| !line.is_empty());
    let said = lines.collect::<Vec<_>>().join(" ");
    let mut text = without_quotes(&without_quoted_kinds(&said));
    // What may follow an endpoint can be a private key.
    if let Some(at) = text.find('#') {
        text.truncate(at);
        text.push_str(LEFT_OUT);
    }
    text + &place
}

/// The message within the `Debug` form of an error of JSON5, and its place; another message is as it was.
fn unquoted(message: &str) -> (String, String) {
    const MESSAGE: &str = "msg: \"";
    let Some((_, rest)) = message.split_once(MESSAGE) else { return (message.to_owned(), String::new()) };
    let (mut said, mut chars) = (String::new(), rest.chars());
    while let Some(c) = chars.next() {
        match c {
            '"' => break,
            '\\' => match chars.next() {
                Some('n') => said.push('\n'),
                Some(escaped) => said.push(escaped),
                None => {}
            },
            other => said.push(other),
        }
    }
    let number_after = |word: &str| {
        let (_, rest) = chars.as_str().split_once(word)?;
        let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
        (!digits.is_empty()).then_some(digits)
    };
    let place = match (number_after("line: "), number_after("column: ")) {
        (Some(line), Some(column)) => format!(" at line {line}, column {column}"),
        _ => String::new(),
    };
    (said, place)
}

/// `12 | password: "…"`, and the lines with marks below it.
fn is_excerpt(line: &str) -> bool {
    line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().starts_with('|')
}

/// Without values in backticks.
fn without_quoted_kinds(text: &str) -> String {
    let mut text = text.to_owned();
    for kind in KINDS {
        let begin = format!("{kind}`");
        let mut from = 0;
        while let Some(at) = text[from..].find(&begin).map(|at| from + at + kind.len()) {
            // Nobody says that a value holds no backtick: up to what serde writes behind it.
            let rest = &text[at..];
            let end = rest.find("`, expected").map_or(rest.len(), |end| end + 1);
            text.replace_range(at..at + end, LEFT_OUT);
            from = at + LEFT_OUT.len();
        }
    }
    text
}

/// Without values in quotation marks, which may hold such marks: from the first one to the last one.
fn without_quotes(text: &str) -> String {
    let Some(first) = text.find('"') else { return text.to_owned() };
    // A value of several lines, or one that is cut, has no second one.
    let last = text.rfind('"').filter(|last| *last > first).unwrap_or(text.len() - 1);
    format!("{}{LEFT_OUT}{}", &text[..first], &text[last + 1..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use zenoh::Config;

    const SECRET: &str = "open-sesame-7";

    /// What is said of a configuration in a file with this ending.
    fn said(name: &str, text: &str) -> String {
        let path: PathBuf =
            std::env::temp_dir().join(format!("v2x-unreadable-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let error = Config::from_file(&path).expect_err(text).to_string();
        std::fs::remove_file(&path).unwrap();
        without_values(&error)
    }

    #[test]
    fn an_error_of_a_tls_configuration_names_key_and_place_and_quotes_no_secret() {
        let usrpwd = |inner: &str| format!("{{\n transport: {{ auth: {{ usrpwd: {{ {inner} }} }} }}\n}}");
        let unusable = [
            usrpwd(&format!("user: \"ego\", password: \"{SECRET}\" secret: 1")),
            usrpwd(&format!("user: \"ego\", password: \"{SECRET}")),
            usrpwd(&format!("user: \"ego\", password: {SECRET}")),
            usrpwd(&format!("password: [\"{SECRET}\"]")),
            usrpwd(&format!("passwort: \"{SECRET}\"")),
            format!("{{ transport: {{ auth: {{ usrpwd: \"ego:{SECRET}\" }} }} }}"),
            format!("{{ transport: {{ auth: \"{SECRET}\\\" x\" }} }}"),
            format!("{{ mode: \"{SECRET}\" }}"),
            format!("{{ connect: {{ endpoints: [\"tls#connect_private_key_base64={SECRET}\"] }} }}"),
            format!("{{ connect: {{ timeout_ms: \"{SECRET}\" }} }}"),
            SECRET.to_owned(),
        ];
        for text in &unusable {
            let said = said("a.json5", text);
            assert!(!said.contains("sesame") && !said.is_empty(), "{text}: {said}");
        }
        let said = said("b.json5", &usrpwd(&format!("passwort: \"{SECRET}\"")));
        assert!(said.contains("passwort") && said.contains("line 2"), "{said}");
    }

    #[test]
    fn numbers_and_yaml_of_a_tls_configuration_are_quoted_no_more_than_texts() {
        let said_of = said("c.json5", "{ transport: { auth: { usrpwd: { password: 314159 } } } }");
        assert!(!said_of.contains("314159"), "{said_of}");
        let said_of = said("d.yaml", &format!("transport:\n  auth:\n    usrpwd: {SECRET}\n"));
        assert!(!said_of.contains("sesame"), "{said_of}");
        let whole = format!("Invalid configuration: {{\"password\": \"{SECRET}\"}}");
        assert!(!without_values(&whole).contains("sesame"));
    }

    #[test]
    fn what_is_no_value_of_a_tls_configuration_is_kept() {
        let said = without_values("Unsupported file type '.txt' (.json, .json5 and .yaml are supported)");
        assert!(said.contains(".txt") && said.contains("json5"), "{said}");
        assert_eq!(
            without_values("No such file or directory (os error 2)"),
            "No such file or directory (os error 2)"
        );
    }
}

//! Rust text as words and signs, without comments, literals and lifetimes.

/// What imports are made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Token {
    /// A name or a keyword.
    Word(String),
    /// `::`
    PathSeparator,
    /// Any other sign.
    Sign(char),
}

/// A token with its line, from 1.
pub(crate) type Placed = (Token, usize);

/// The tokens of a file.
pub(crate) fn tokens(text: &str) -> Vec<Placed> {
    let mut rest = text;
    let mut line = 1;
    let mut tokens = Vec::new();
    while let Some(first) = rest.chars().next() {
        let (token, length) = next(rest, first);
        let (taken, after) = rest.split_at(length);
        tokens.extend(token.map(|token| (token, line)));
        line += taken.matches('\n').count();
        rest = after;
    }
    tokens
}

/// The token at the start of `rest`, if any, and the number of bytes that it takes.
fn next(rest: &str, first: char) -> (Option<Token>, usize) {
    if rest.starts_with("//") {
        return (None, rest.find('\n').unwrap_or(rest.len()));
    }
    if rest.starts_with("/*") {
        return (None, block_comment(rest));
    }
    if let Some(length) = raw_string(rest) {
        return (None, length);
    }
    if rest.starts_with("::") {
        return (Some(Token::PathSeparator), 2);
    }
    match first {
        '"' => (None, quoted(rest, '"')),
        '\'' => (None, char_or_lifetime(rest)),
        _ if first.is_alphanumeric() || first == '_' => word(rest, first),
        _ if first.is_whitespace() => (None, first.len_utf8()),
        _ => (Some(Token::Sign(first)), first.len_utf8()),
    }
}

/// A name; numbers are taken whole and dropped. `r#type` is the name `type`.
fn word(rest: &str, first: char) -> (Option<Token>, usize) {
    let prefix = if rest.starts_with("r#") { 2 } else { 0 };
    let name = &rest[prefix..];
    let length = name.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(name.len());
    let token = (!first.is_ascii_digit()).then(|| Token::Word(name[..length].to_owned()));
    (token, prefix + length)
}

/// The length of a comment in which others may be nested.
fn block_comment(rest: &str) -> usize {
    let mut depth = 0_usize;
    let mut at = 0;
    while at < rest.len() {
        if rest[at..].starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest[at..].starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                break;
            }
        } else {
            at += rest[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    at
}

/// The length of `r"…"` or `r#"…"#`, also of bytes, if there is one.
fn raw_string(rest: &str) -> Option<usize> {
    let body = ["r", "br", "cr"].iter().find_map(|prefix| rest.strip_prefix(prefix))?;
    let hashes = body.len() - body.trim_start_matches('#').len();
    let text = body[hashes..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    let length = text.find(&end).map_or(text.len(), |at| at + end.len());
    Some(rest.len() - text.len() + length)
}

/// The length of a literal from its first to its last quote; a backslash escapes one character.
fn quoted(rest: &str, quote: char) -> usize {
    let mut is_escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        if c == quote && !is_escaped {
            return at + c.len_utf8();
        }
        is_escaped = c == '\\' && !is_escaped;
    }
    rest.len()
}

/// `'a'` and `'\n'` end in a quote, the lifetime `'a` does not.
fn char_or_lifetime(rest: &str) -> usize {
    let mut after = rest.chars().skip(1);
    match (after.next(), after.next()) {
        (Some('\\'), _) | (Some(_), Some('\'')) => quoted(rest, '\''),
        _ => rest[1..].find(|c: char| !c.is_alphanumeric() && c != '_').map_or(rest.len(), |at| at + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(String, usize)> {
        let words = tokens(text).into_iter().filter_map(|(token, line)| match token {
            Token::Word(word) => Some((word, line)),
            _ => None,
        });
        words.collect()
    }

    #[test]
    fn comments_literals_numbers_and_lifetimes_are_no_words() {
        let text = r####"
            // crate::line
            /* crate::block /* nested */ still */
            let a = "crate::text \" more"; let b = r#"raw " crate::x"#; let c = br"bytes";
            fn f<'a>(x: &'a str) { let d = ('x', '\'', '"', 1e6, 0x_ff); r#type }
        "####;
        let names: Vec<_> = words(text).into_iter().map(|(word, _)| word).collect();
        let expected = ["let", "a", "let", "b", "let", "c", "fn", "f", "x", "str", "let", "d", "type"]
            .map(str::to_owned);
        assert_eq!(names, expected);
    }

    #[test]
    fn each_word_knows_its_line_also_after_a_literal_of_several_lines() {
        let text = "a\n\"two\nlines\" b\n/* three\n\n*/ c";
        assert_eq!(words(text), [("a".to_owned(), 1), ("b".to_owned(), 3), ("c".to_owned(), 6)]);
    }

    #[test]
    fn a_path_separator_is_one_token() {
        let kinds: Vec<_> = tokens("a::b: c").into_iter().map(|(token, _)| token).collect();
        let word = |name: &str| Token::Word(name.to_owned());
        assert_eq!(kinds, [word("a"), Token::PathSeparator, word("b"), Token::Sign(':'), word("c")]);
    }
}

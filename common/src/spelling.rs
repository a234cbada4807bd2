//! Which known word is meant by one that is not known.

/// Longer words are not compared: they may come from anybody.
const MOST_CHARS: usize = 40;
/// So many characters that are compared may have one mistake.
const CHARS_TO_A_MISTAKE: usize = 3;
/// What readers say before a word that they do not know.
const UNKNOWN: [&str; 2] = ["unknown field `", "unknown variant `"];

/// The nearest of some known words; `None` where none is near. Case, and `_` and `-` within a word, do not count.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = folded(word)?;
    let near = known.into_iter().filter_map(|one| {
        let other = folded(one)?;
        let limit = word.len().max(other.len()) / CHARS_TO_A_MISTAKE;
        if word.len().abs_diff(other.len()) > limit {
            return None;
        }
        let mistakes = mistakes(&word, &other);
        (mistakes <= limit).then_some((mistakes, one))
    });
    near.min_by_key(|(mistakes, _)| *mistakes).map(|(_, one)| one)
}

/// A reader's words about a field or variant that it does not know, with the one that is meant; `other_names` are words of other
/// formats, each with ours. Other words are as they were.
pub fn hinted(words: &str, other_names: &[(&str, &str)]) -> String {
    let hint = || {
        let start = UNKNOWN.into_iter().find_map(|begin| Some(words.find(begin)? + begin.len()))?;
        let end = start + words[start..].find('`')?;
        let known: Vec<_> = words[end + 1..].split('`').skip(1).step_by(2).collect();
        let name = &words[start..end];
        let other = other_names.iter().find(|(other, ours)| {
            folded(other).is_some_and(|other| folded(name) == Some(other)) && known.contains(ours)
        });
        let meant = other.map(|(_, ours)| *ours).or_else(|| nearest(name, known))?;
        Some(format!("{} (did you mean `{meant}`?){}", &words[..=end], &words[end + 1..]))
    };
    hint().unwrap_or_else(|| words.to_owned())
}

/// What is compared of a word; `None` of one that is empty or too long.
fn folded(word: &str) -> Option<Vec<char>> {
    let is_compared = |c: &char| !matches!(c, '_' | '-' | ' ');
    let chars: Vec<_> =
        word.chars().filter(is_compared).take(MOST_CHARS + 1).map(|c| c.to_ascii_lowercase()).collect();
    (!chars.is_empty() && chars.len() <= MOST_CHARS).then_some(chars)
}

/// How many characters are to be put in, left out, replaced, or exchanged with their neighbour (the optimal string alignment
/// distance).
fn mistakes(a: &[char], b: &[char]) -> usize {
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_with_a_mistake_or_two_is_recognised_and_another_word_is_not() {
        let known = ["captured_at", "detections", "class", "x", "yaw", "rsu-north"];
        for (word, meant) in [
            ("capturd_at", Some("captured_at")),
            ("capturedAt", Some("captured_at")),
            ("captured", Some("captured_at")),
            ("detetcions", Some("detections")),
            ("clas", Some("class")),
            ("X", Some("x")),
            ("rsu_north", Some("rsu-north")),
            ("rsunorht", Some("rsu-north")),
            ("y", None),
            ("label", None),
            ("timestamp", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, known), meant, "{word}");
        }
        assert_eq!(nearest(&"x".repeat(100_000), known), None);
    }

    #[test]
    fn what_is_meant_stands_behind_the_word_that_is_not_known() {
        let hint = |words: &str| hinted(words, &[("label", "class"), ("theta", "yaw")]);
        assert_eq!(
            hint("unknown field `clas`, expected one of `class`, `x` at line 1 column 9"),
            "unknown field `clas` (did you mean `class`?), expected one of `class`, `x` at line 1 column 9"
        );
        assert!(hint("unknown field `Label`, expected `class` or `x`").contains("(did you mean `class`?)"));
        assert!(hint("unknown variant `knwon`, expected `known`").contains("(did you mean `known`?)"));
        for as_it_was in [
            "unknown field `theta`, expected `class` or `x`",
            "missing field `class`",
            "unknown field `clas",
            "unknown field ``",
        ] {
            assert_eq!(hint(as_it_was), as_it_was);
        }
    }
}

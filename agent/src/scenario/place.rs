//! Where in a scenario's text a value is.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The bytes of a value by its path, such as `agents[1].link.loss`; of the innermost part of the path that is in the text.
pub(super) fn span_of(text: &str, path: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let mut names = path.split(['.', '[', ']']).filter(|name| !name.is_empty());
    let mut value = document.get_ref().get(names.next()?)?;
    for name in names {
        match child(value, name) {
            Some(inner) => value = inner,
            None => break,
        }
    }
    Some(value.span())
}

fn child<'a, 'b>(value: &'a Spanned<DeValue<'b>>, name: &str) -> Option<&'a Spanned<DeValue<'b>>> {
    match value.get_ref() {
        DeValue::Table(table) => table.get(name),
        DeValue::Array(values) => values.get(name.parse::<usize>().ok()?),
        _ => None,
    }
}

/// Line and column of a value by its path, counted from 1.
pub(super) fn line_and_column(text: &str, path: &str) -> Option<(u32, u32)> {
    let before = text.get(..span_of(text, path)?.start)?;
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    let (lines, columns) = (before.matches('\n').count(), before[line_start..].chars().count());
    Some((u32::try_from(lines).ok()? + 1, u32::try_from(columns).ok()? + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "name = \"a\"\n[world]\nkind = \"b\"\n[[agents]]\nid = \"x\"\n[[agents]]\nlink = { loss = 7 }\n";

    #[test]
    fn a_value_is_found_by_its_path_and_a_missing_one_by_what_it_is_missing_in() {
        assert_eq!(line_and_column(TEXT, "name"), Some((1, 8)));
        assert_eq!(line_and_column(TEXT, "agents[1].link.loss"), Some((7, 17)));
        assert_eq!(line_and_column(TEXT, "agents[0].pose.x"), Some((4, 1)));
        assert_eq!(line_and_column(TEXT, "world.file"), Some((2, 1)));
        assert_eq!(line_and_column(TEXT, "nothing"), None);
    }
}

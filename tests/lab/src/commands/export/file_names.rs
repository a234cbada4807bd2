//! File names of scenes.

use std::collections::BTreeSet;

/// Longest file name without its extension, bytes.
const MAX_LEN: usize = 100;

/// One file name for each scene. They differ on file systems that ignore case, too. Letters, digits, `-`, `_` and
/// `.` stay; any other character becomes `_`.
pub(crate) fn file_names<'a>(scenes: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let unique = |name: &'a str| {
        let stem = safe(name);
        let numbered = (2..).map(|number| format!("{stem}-{number}"));
        let name =
            std::iter::once(stem.clone()).chain(numbered).find(|name| taken.insert(name.to_lowercase()));
        name.unwrap_or(stem) + ".csv"
    };
    scenes.map(unique).collect()
}

fn safe(name: &str) -> String {
    let is_safe = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let kept: String = name.chars().map(|c| if is_safe(c) { c } else { '_' }).take(MAX_LEN).collect();
    match kept.chars().next() {
        // A leading `.` hides the file; a leading `-` looks like an option.
        Some('.' | '-') | None => format!("_{kept}"),
        Some(_) => kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_scenes_have_different_files_on_any_system() {
        let names = file_names(["scene-0001", "a/b", "a b", "A_B", "..", "", "ä"].into_iter());
        assert_eq!(
            names,
            ["scene-0001.csv", "a_b.csv", "a_b-2.csv", "A_B-3.csv", "_...csv", "_.csv", "_-2.csv"]
        );
    }
}

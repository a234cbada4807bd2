//! Circles of files that need each other.

use crate::graph::Reference;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// From each file, the first reference to each other file.
type Arrows<'a> = BTreeMap<&'a str, BTreeMap<&'a str, &'a Reference>>;

/// One shortest circle of each group of files that all lead to one another.
pub(crate) fn circles(references: &[Reference]) -> Vec<Vec<&Reference>> {
    let arrows = arrows(references);
    let mut circles = Vec::new();
    let mut in_groups = BTreeSet::new();
    for file in arrows.keys() {
        if !in_groups.contains(file) && shortest(&arrows, file).is_some() {
            let group = group(&arrows, file);
            circles.extend(group.iter().filter_map(|each| shortest(&arrows, each)).min_by_key(Vec::len));
            in_groups.extend(group);
        }
    }
    circles
}

/// `a.rs → b.rs (line 3: crate::b::B) → a.rs (line 7: super::a)`, with lines of the file before each arrow.
pub(crate) fn in_words(circle: &[&Reference]) -> String {
    let first = circle.first().map_or("", |reference| &reference.from);
    circle.iter().fold(first.to_owned(), |words, reference| {
        format!("{words} → {} (line {}: {})", reference.to, reference.line, reference.path)
    })
}

fn arrows(references: &[Reference]) -> Arrows<'_> {
    let mut arrows = Arrows::new();
    for reference in references.iter().filter(|reference| !reference.is_facade) {
        arrows.entry(&reference.from).or_default().entry(&reference.to).or_insert(reference);
    }
    arrows
}

/// All files that lead to this one and that it leads to.
fn group<'a>(arrows: &Arrows<'a>, file: &'a str) -> BTreeSet<&'a str> {
    let ahead = steps(arrows, file).into_keys();
    ahead.filter(|each| steps(arrows, each).contains_key(file)).collect()
}

/// The shortest way from a file back to itself.
fn shortest<'a>(arrows: &Arrows<'a>, file: &'a str) -> Option<Vec<&'a Reference>> {
    let steps = steps(arrows, file);
    let mut circle = vec![*steps.get(file)?];
    while let Some(first) = circle.last().filter(|reference| reference.from != file) {
        circle.push(steps[first.from.as_str()]);
    }
    circle.reverse();
    Some(circle)
}

/// For each file that can be reached, the last step of a shortest way to it.
fn steps<'a>(arrows: &Arrows<'a>, from: &'a str) -> BTreeMap<&'a str, &'a Reference> {
    let mut steps = BTreeMap::new();
    let mut queue = VecDeque::from([from]);
    while let Some(file) = queue.pop_front() {
        for (to, reference) in arrows.get(file).into_iter().flatten() {
            if !steps.contains_key(to) {
                steps.insert(*to, *reference);
                queue.push_back(to);
            }
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn references(arrows: &[(&str, &str)]) -> Vec<Reference> {
        let reference = |(at, (from, to)): (usize, &(&str, &str))| Reference {
            from: (*from).to_owned(),
            line: at + 1,
            path: format!("crate::{to}"),
            to: (*to).to_owned(),
            is_facade: false,
        };
        arrows.iter().enumerate().map(reference).collect()
    }

    #[test]
    fn files_that_need_each_other_are_shown_as_the_shortest_circle() {
        let references =
            references(&[("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("c", "a"), ("x", "a")]);
        let found: Vec<_> = circles(&references).iter().map(|circle| in_words(circle)).collect();
        assert_eq!(found, ["a → b (line 1: crate::b) → c (line 2: crate::c) → a (line 5: crate::a)"]);
    }

    #[test]
    fn circles_apart_are_shown_each() {
        assert_eq!(
            circles(&references(&[("a", "b"), ("b", "a"), ("b", "c"), ("c", "d"), ("d", "c")])).len(),
            2
        );
    }

    #[test]
    fn files_in_layers_have_no_circle() {
        assert!(circles(&references(&[("a", "b"), ("a", "c"), ("b", "d"), ("c", "d")])).is_empty());
    }
}

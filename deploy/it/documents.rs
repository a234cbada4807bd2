//! The documents of the repository: links lead somewhere, examples are the files that are tested.

use anyhow::{Context, ensure};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Most lines of the README: what is longer belongs on a page.
const README_LINES: usize = 200;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))
}

/// Every Markdown file outside of hidden folders and build results.
fn documents() -> anyhow::Result<Vec<PathBuf>> {
    let mut documents = Vec::new();
    let mut folders = vec![repository()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let is_left_out = name.starts_with('.') || ["target", "v2x-runs", "v2x-sweeps"].contains(&&*name);
            if path.is_dir() && !is_left_out {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                documents.push(path);
            }
        }
    }
    documents.sort();
    Ok(documents)
}

/// The lines outside of fenced blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_fenced = false;
    text.lines().filter(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_fenced ^= is_fence;
        !is_fence && !is_fenced
    })
}

/// The fenced blocks of a language, with their last line break.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let fence = format!("\n```{language}\n");
    text.split(&fence)
        .skip(1)
        .filter_map(|rest| Some(rest.split_once("\n```")?.0.to_owned() + "\n"))
        .collect()
}

/// The targets of all `[text](target)` and `![text](target)`.
fn links(text: &str) -> Vec<String> {
    let targets = prose(text).flat_map(|line| line.split("](").skip(1));
    targets.filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())).collect()
}

/// The names under which headings can be linked to: lower case, words joined by hyphens.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings =
        prose(text).filter_map(|line| Some(line.strip_prefix('#')?.trim_start_matches('#').trim()));
    headings
        .map(|heading| {
            let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>().to_lowercase()
        })
        .collect()
}

/// Why a link of a document leads nowhere.
fn fault(document: &Path, text: &str, link: &str) -> anyhow::Result<Option<String>> {
    if link.contains("://") || link.starts_with("mailto:") {
        return Ok(None);
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = document.parent().context("a file is in a folder")?.join(file);
    if !file.is_empty() && !target.exists() {
        return Ok(Some(format!("{}: no file {file}", document.display())));
    }
    if anchor.is_empty() {
        return Ok(None);
    }
    let has_anchor = if file.is_empty() { anchors(text) } else { anchors(&read(&target)?) }.contains(anchor);
    Ok((!has_anchor).then(|| format!("{}: no heading {link}", document.display())))
}

#[test]
fn every_relative_link_and_anchor_leads_somewhere() -> anyhow::Result<()> {
    let (mut n_links, mut faults) = (0, Vec::new());
    for document in documents()? {
        let text = read(&document)?;
        for link in links(&text) {
            n_links += 1;
            faults.extend(fault(&document, &text, &link)?);
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
    ensure!(n_links > 50, "only {n_links} links were found");
    Ok(())
}

#[test]
fn every_page_can_be_reached_from_the_readme() -> anyhow::Result<()> {
    let linked: BTreeSet<_> = links(&read(&repository().join("README.md"))?).into_iter().collect();
    for page in std::fs::read_dir(repository().join("deploy/docs"))? {
        let name = page?.file_name().to_string_lossy().into_owned();
        let is_linked = linked.contains(&format!("deploy/docs/{name}"));
        ensure!(!name.ends_with(".md") || is_linked, "the README has no link to {name}");
    }
    Ok(())
}

#[test]
fn the_readme_is_short() -> anyhow::Result<()> {
    let n_lines = read(&repository().join("README.md"))?.lines().count();
    assert!(n_lines <= README_LINES, "{n_lines} lines");
    Ok(())
}

#[test]
fn the_guides_programs_are_the_files_that_are_run() -> anyhow::Result<()> {
    let guide = read(&repository().join("deploy/docs/guide.md"))?;
    let client = read(&repository().join("deploy/examples/foreign_client.py"))?;
    assert_eq!(blocks(&guide, "python"), [client], "deploy/examples/foreign_client.py");
    let test = read(&repository().join("tests/it/loopback/guide.rs"))?;
    let blocks = blocks(&guide, "rust");
    assert!(blocks.len() == 1 && test.ends_with(&blocks[0]), "tests/it/loopback/guide.rs");
    Ok(())
}

#[test]
fn links_and_headings_are_read_outside_of_code() {
    let text =
        "# One, Two & `x`\n[a](b.md#c) ![d](e.svg)\n```md\n[no](no.md)\n# no\n```\n## The paper's tables\n";
    assert_eq!(links(text), ["b.md#c", "e.svg"]);
    assert_eq!(anchors(text).into_iter().collect::<Vec<_>>(), ["one-two--x", "the-papers-tables"]);
    assert_eq!(blocks("a\n```rust\nfn f() {}\n```\n", "rust"), ["fn f() {}\n"]);
}

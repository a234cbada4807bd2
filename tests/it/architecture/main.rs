//! The layers of ARCHITECTURE.md: no file imports from a higher layer, and no files import each other in a circle.
//!
//! The imports are read from the text of each crate: `use` declarations, and paths within code. Each is followed to the
//! file that defines what it names, through re-exports. Code for tests alone is left out.

mod circles;
mod graph;
mod layers;
mod lexer;
mod syntax;
mod trees;

use graph::{Graph, Sources};
use layers::Layers;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// The folders whose imports are checked, by the names of their blocks in ARCHITECTURE.md.
const CHECKED: [&str; 5] = ["common/src", "agent/src", "fusion-hub/src", "tests/lab/src", "deploy/src"];

#[test]
fn no_import_goes_up_and_none_goes_in_a_circle() -> Result<(), Box<dyn Error>> {
    let plans = Layers::parse_all(&fs::read_to_string(repository().join("ARCHITECTURE.md"))?);
    let mut faults = Vec::new();
    for folder in CHECKED {
        let plan = plans.iter().find(|plan| plan.folder == folder);
        let plan = plan.ok_or_else(|| format!("ARCHITECTURE.md has no layers of {folder}"))?;
        faults.extend(check(plan, &sources(&repository().join(plan.source_folder()))?)?);
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    Ok(())
}

/// What breaks the layers, as lines to read.
fn check(plan: &Layers, sources: &Sources) -> Result<Vec<String>, String> {
    let graph = Graph::new(sources).map_err(|error| format!("{}: {error}", plan.folder))?;
    let references = graph.references();
    let mut faults = plan.mismatches(&graph);
    faults.extend(plan.violations(&references));
    let circles = circles::circles(&references);
    let circles = circles.iter().map(|circle| circles::in_words(circle));
    faults.extend(circles.map(|circle| format!("{}: circle {circle}", plan.source_folder())));
    Ok(faults)
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every Rust file of a folder and those below it.
fn sources(folder: &Path) -> Result<Sources, Box<dyn Error>> {
    let mut sources = Sources::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(each) = folders.pop() {
        for entry in fs::read_dir(&each).map_err(|error| format!("{}: {error}", each.display()))? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let below = path.strip_prefix(folder)?.to_string_lossy().replace('\\', "/");
                sources.insert(below, fs::read_to_string(&path)?);
            }
        }
    }
    Ok(sources)
}

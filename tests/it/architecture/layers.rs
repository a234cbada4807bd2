//! The layers that ARCHITECTURE.md plans for a folder, and what imports break them.

use crate::graph::{Graph, Reference};
use std::collections::BTreeSet;

/// Opens a block of layers, before the folder's name.
const FENCE: &str = "\n```layers ";

/// The parts of a folder, its files and folders, from the lowest layer to the highest.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Layers {
    /// From the repository's root, such as `deploy/src`.
    pub(crate) folder: String,
    /// Parts of one layer do not import each other.
    layers: Vec<Vec<String>>,
}

impl Layers {
    /// Every block of a document: one line is one layer, its parts are separated by commas, `#` begins a comment.
    pub(crate) fn parse_all(markdown: &str) -> Vec<Self> {
        let blocks = markdown.split(FENCE).skip(1);
        let parsed = blocks.map(|block| {
            let mut lines = block.lines().take_while(|line| !line.starts_with("```"));
            let folder = lines.next().unwrap_or_default().trim().to_owned();
            let lines = lines.map(|line| line.split('#').next().unwrap_or_default());
            let parts = lines.map(|line| {
                let names = line.split(',').map(str::trim).filter(|name| !name.is_empty());
                names.map(str::to_owned).collect::<Vec<_>>()
            });
            Self { folder, layers: parts.filter(|parts| !parts.is_empty()).collect() }
        });
        parsed.collect()
    }

    /// The crate's source folder, and what of its paths is the folder of these layers.
    fn split_folder(&self) -> (&str, &str) {
        let source = self.folder.find("/src").map_or(self.folder.len(), |at| at + "/src".len());
        let (source, below) = self.folder.split_at(source);
        (source, below.trim_start_matches('/'))
    }

    /// The crate's source folder.
    pub(crate) fn source_folder(&self) -> &str {
        self.split_folder().0
    }

    /// What is in the folder and in no layer, in two layers, or in a layer and not in the folder.
    pub(crate) fn mismatches(&self, graph: &Graph) -> Vec<String> {
        let there: BTreeSet<_> = graph.files().filter_map(|file| self.part(file)).collect();
        let mut planned = BTreeSet::new();
        let mut mismatches = Vec::new();
        for part in self.layers.iter().flatten() {
            if !planned.insert(part.as_str()) {
                mismatches.push(format!("{}: {part} is in the plan twice", self.folder));
            }
        }
        let unplanned = there.difference(&planned).map(|part| format!("{part} is in no layer"));
        let missing = planned.difference(&there).map(|part| format!("{part} is in the plan, and not there"));
        mismatches.extend(unplanned.chain(missing).map(|words| format!("{}: {words}", self.folder)));
        mismatches
    }

    /// The imports into a higher layer, or into another part of the same one.
    pub(crate) fn violations(&self, references: &[Reference]) -> Vec<String> {
        references.iter().filter_map(|reference| self.violation(reference)).collect()
    }

    fn violation(&self, reference: &Reference) -> Option<String> {
        let (from, to) = (self.part(&reference.from)?, self.part(&reference.to)?);
        let (from_idx, to_idx) = (self.layer_idx(from)?, self.layer_idx(to)?);
        if from == to || to_idx < from_idx {
            return None;
        }
        let direction = if to_idx == from_idx { "beside it" } else { "above it" };
        let Reference { from: file, line, path, to: target, .. } = reference;
        Some(format!(
            "{}/{file}:{line} imports `{path}` ({target}): {from} is in layer {} ({}), {to} is {direction} in layer {} ({})",
            self.source_folder(),
            from_idx + 1,
            self.layers[from_idx].join(", "),
            to_idx + 1,
            self.layers[to_idx].join(", "),
        ))
    }

    /// The file or folder directly below the layers' folder that a file is or lies in; the folder's own `mod.rs`,
    /// `lib.rs` and `main.rs` are in no layer.
    fn part<'a>(&self, file: &'a str) -> Option<&'a str> {
        let (_, folder) = self.split_folder();
        let below = match folder {
            "" => file,
            _ => file.strip_prefix(folder)?.strip_prefix('/')?,
        };
        let first = below.split('/').next()?;
        let is_root = ["mod.rs", "lib.rs", "main.rs"].contains(&first);
        (!is_root).then(|| first.trim_end_matches(".rs"))
    }

    fn layer_idx(&self, part: &str) -> Option<usize> {
        self.layers.iter().position(|layer| layer.iter().any(|each| each == part))
    }
}

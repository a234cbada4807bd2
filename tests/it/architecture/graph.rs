//! Which file of a crate uses which: every import and path, followed to the file that defines what it names.

use crate::syntax::{ParsedModule, Path, parse};
use std::collections::BTreeMap;

/// The texts of a crate's files by their paths below its source folder.
pub(crate) type Sources = BTreeMap<String, String>;

/// One file that uses another of its crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Reference {
    pub(crate) from: String,
    pub(crate) line: usize,
    /// As it is written.
    pub(crate) path: String,
    pub(crate) to: String,
    /// A module that only passes on a name from below itself: it does not depend on it.
    pub(crate) is_facade: bool,
}

/// The modules of a crate, those for tests apart.
pub(crate) struct Graph {
    modules: BTreeMap<Path, Module>,
}

struct Module {
    file: String,
    parsed: ParsedModule,
}

/// What a path leads to: a module, or an item that the module defines.
struct Target {
    module: Path,
    is_item: bool,
}

/// Names that are imported from where they are imported are followed so often at most.
const LONGEST_CHAIN: u32 = 8;

impl Graph {
    /// Follows the `mod` declarations from the crate's root on.
    pub(crate) fn new(sources: &Sources) -> Result<Self, String> {
        let root = ["lib.rs", "main.rs"].into_iter().find(|root| sources.contains_key(*root));
        let mut graph = Self { modules: BTreeMap::new() };
        graph.add_file(sources, root.ok_or("neither lib.rs nor main.rs")?, &[])?;
        Ok(graph)
    }

    fn add_file(&mut self, sources: &Sources, file: &str, place: &[String]) -> Result<(), String> {
        let text = sources.get(file).ok_or_else(|| format!("no file {file}"))?;
        for parsed in parse(text) {
            let place = [place, &parsed.place].concat();
            for name in &parsed.files_below {
                let below = [place.as_slice(), std::slice::from_ref(name)].concat();
                self.add_file(sources, file_of(sources, &below)?, &below)?;
            }
            self.modules.insert(place, Module { file: file.to_owned(), parsed });
        }
        Ok(())
    }

    /// The files of all modules.
    pub(crate) fn files(&self) -> impl Iterator<Item = &str> {
        self.modules.values().map(|module| module.file.as_str())
    }

    /// Every use of one file by another, in the order of files and lines.
    pub(crate) fn references(&self) -> Vec<Reference> {
        let mut references: Vec<_> = self.modules.iter().flat_map(|each| self.references_of(each)).collect();
        references.sort_by(|a, b| (&a.from, a.line).cmp(&(&b.from, b.line)));
        references
    }

    fn references_of(&self, (place, module): (&Path, &Module)) -> Vec<Reference> {
        let of_imports = module.parsed.imports.iter().filter_map(|import| {
            let target = self.resolve(place, &import.path, LONGEST_CHAIN)?;
            let is_below = target.module.len() > place.len() && target.module.starts_with(place);
            let is_facade = import.is_reexport && is_below && !module.parsed.words.contains(&import.name);
            Some((&import.path, import.line, target, is_facade))
        });
        let of_mentions = module.parsed.mentions.iter().filter_map(|mention| {
            let target = self.resolve(place, &mention.path, LONGEST_CHAIN)?;
            Some((&mention.path, mention.line, target, false))
        });
        let references = of_imports.chain(of_mentions).map(|(path, line, target, is_facade)| Reference {
            from: module.file.clone(),
            line,
            path: path.join("::"),
            to: self.modules[&target.module].file.clone(),
            is_facade,
        });
        references.filter(|reference| reference.from != reference.to).collect()
    }

    /// Where a path leads that is written in the module `place`; `None` for other crates and local names.
    fn resolve(&self, place: &[String], path: &[String], chain: u32) -> Option<Target> {
        let (first, rest) = path.split_first()?;
        let start = match first.as_str() {
            "crate" => Target::module(&[]),
            "self" => Target::module(place),
            "super" => Target::module(parent(place)?),
            name => self.member(place, name, chain)?,
        };
        rest.iter().try_fold(start, |target, name| match name.as_str() {
            _ if target.is_item => Some(target),
            "super" => Some(Target::module(parent(&target.module)?)),
            // What a macro has made is not to be seen here: it is the module's own.
            name => self.member(&target.module, name, chain).or(Some(Target::item(&target.module))),
        })
    }

    /// What a name is within a module: a module below it, an import, an item of its own, or one of a glob import.
    fn member(&self, place: &[String], name: &str, chain: u32) -> Option<Target> {
        let below = [place, &[name.to_owned()]].concat();
        if self.modules.contains_key(&below) {
            return Some(Target::module(&below));
        }
        let module = &self.modules.get(place)?.parsed;
        let chain = chain.checked_sub(1)?;
        if let Some(import) = module.imports.iter().find(|import| import.name == name) {
            return self.resolve(place, &import.path, chain);
        }
        if module.declared.contains(name) {
            return Some(Target::item(place));
        }
        let mut globs = module.imports.iter().filter(|import| import.name == "*");
        globs.find_map(|glob| {
            let target = self.resolve(place, &glob.path, chain)?;
            if target.is_item { None } else { self.member(&target.module, name, chain) }
        })
    }
}

impl Target {
    fn module(place: &[String]) -> Self {
        Self { module: place.to_vec(), is_item: false }
    }

    fn item(place: &[String]) -> Self {
        Self { module: place.to_vec(), is_item: true }
    }
}

fn parent(place: &[String]) -> Option<&[String]> {
    place.split_last().map(|(_, parent)| parent)
}

/// The file of a module: `a/b.rs` or `a/b/mod.rs`.
fn file_of<'a>(sources: &'a Sources, place: &[String]) -> Result<&'a str, String> {
    let path = place.join("/");
    let candidates = [format!("{path}.rs"), format!("{path}/mod.rs")];
    let found = candidates.iter().find_map(|candidate| sources.get_key_value(candidate));
    found.map(|(file, _)| file.as_str()).ok_or_else(|| format!("module {} has no file", place.join("::")))
}

//! The modules of one file: what each declares, imports and mentions. Not a full parser: just what imports need.

use crate::lexer::{Placed, Token, tokens};
use std::collections::BTreeSet;

/// A path as it is written, such as `["super", "state", "State"]`.
pub(crate) type Path = Vec<String>;

/// A module of a file: the file itself, or an inline `mod name { … }` of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ParsedModule {
    /// Its place below the file's own module; empty for that one.
    pub(crate) place: Path,
    /// `mod name;`: modules in files of their own.
    pub(crate) files_below: Vec<String>,
    /// Names of functions, types, constants.
    pub(crate) declared: BTreeSet<String>,
    pub(crate) imports: Vec<Import>,
    /// Paths of at least two segments outside of `use`.
    pub(crate) mentions: Vec<Mention>,
    /// Every word outside of `use`.
    pub(crate) words: BTreeSet<String>,
}

/// One name of a `use` declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Import {
    pub(crate) path: Path,
    /// The name that it gets here; `*` for all names of a module.
    pub(crate) name: String,
    /// `pub use`, of any visibility.
    pub(crate) is_reexport: bool,
    pub(crate) line: usize,
}

/// A path within code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mention {
    pub(crate) path: Path,
    pub(crate) line: usize,
}

/// The modules of a file, itself first; what is under `#[cfg(test)]` is left out.
pub(crate) fn parse(text: &str) -> Vec<ParsedModule> {
    let mut parser = Parser { tokens: tokens(text), at: 0, modules: vec![ParsedModule::default()] };
    parser.module_body(0);
    parser.modules
}

struct Parser {
    tokens: Vec<Placed>,
    at: usize,
    modules: Vec<ParsedModule>,
}

/// Keywords that a declared name follows.
const DECLARING: [&str; 8] = ["fn", "struct", "enum", "union", "trait", "type", "const", "static"];

impl Parser {
    /// Reads up to the brace that closes the module, or to the end of the file.
    fn module_body(&mut self, module_idx: usize) {
        let mut depth = 0_usize;
        while let Some((token, _)) = self.tokens.get(self.at) {
            match token {
                Token::Word(_) => {
                    self.word(module_idx, depth == 0);
                    continue;
                }
                Token::Sign('#') if self.is_test_attribute() => {
                    self.skip_item();
                    continue;
                }
                // `::std::fmt` and `<T as Trait>::Item::new` begin elsewhere.
                Token::PathSeparator => {
                    self.path();
                    continue;
                }
                Token::Sign('}') if depth == 0 => break,
                Token::Sign('{') => depth += 1,
                Token::Sign('}') => depth -= 1,
                Token::Sign(_) => {}
            }
            self.at += 1;
        }
    }

    /// Reads what begins with a word: a declaration, an import or a path.
    fn word(&mut self, module_idx: usize, is_top_level: bool) {
        let is_public = self.take_visibility();
        match (self.word_at(0), self.word_at(1)) {
            // Not `impl Trait + use<'a>`.
            (Some("use"), _) if !self.is_sign(1, '<') => self.use_declaration(module_idx, is_public),
            (Some("mod"), Some(name)) if self.is_sign(2, ';') => {
                let name = name.to_owned();
                self.modules[module_idx].files_below.push(name);
                self.at += 3;
            }
            (Some("mod"), Some(name)) => {
                let name = name.to_owned();
                self.inline_module(module_idx, name);
            }
            (Some("const"), Some("fn" | "unsafe" | "async")) => self.at += 1,
            (Some(keyword), Some(name)) if DECLARING.contains(&keyword) => {
                if is_top_level {
                    let name = name.to_owned();
                    self.modules[module_idx].declared.insert(name);
                }
                self.at += 2;
            }
            (Some(_), _) => self.mention(module_idx),
            (None, _) => {}
        }
    }

    /// Passes `pub` or `pub(…)`, if it is there.
    fn take_visibility(&mut self) -> bool {
        if self.word_at(0) != Some("pub") {
            return false;
        }
        self.at += 1;
        let is_restricted = self.is_sign(0, '(');
        if is_restricted && matches!(self.word_at(1), Some("crate" | "super" | "self" | "in")) {
            self.skip_to(')');
        }
        true
    }

    fn inline_module(&mut self, outer_idx: usize, name: String) {
        let mut place = self.modules[outer_idx].place.clone();
        place.push(name);
        self.modules.push(ParsedModule { place, ..ParsedModule::default() });
        self.at += 3;
        self.module_body(self.modules.len() - 1);
        self.at += 1;
    }

    fn mention(&mut self, module_idx: usize) {
        let line = self.line();
        let path = self.path();
        let module = &mut self.modules[module_idx];
        module.words.extend(path.first().cloned());
        if path.len() > 1 {
            module.mentions.push(Mention { path, line });
        }
    }

    /// Reads `a::b::c`; a separator before it or behind it is passed too.
    fn path(&mut self) -> Path {
        let mut path = Path::new();
        loop {
            let is_separated = self.take_separator();
            match self.word_at(0) {
                Some(word) if path.is_empty() || is_separated => path.push(word.to_owned()),
                _ => return path,
            }
            self.at += 1;
        }
    }

    fn use_declaration(&mut self, module_idx: usize, is_reexport: bool) {
        self.at += 1;
        let mut imports = Vec::new();
        if self.take_separator() {
            // `use ::name` is of another crate.
            self.use_tree(&Path::new(), &mut Vec::new());
        } else {
            self.use_tree(&Path::new(), &mut imports);
        }
        self.skip_to(';');
        let imports = imports.into_iter().map(|import| Import { is_reexport, ..import });
        self.modules[module_idx].imports.extend(imports);
    }

    /// Reads `a::{b, c::*, d as e, self}` below a prefix.
    fn use_tree(&mut self, prefix: &Path, imports: &mut Vec<Import>) {
        let line = self.line();
        let mut path = prefix.clone();
        path.extend(self.path());
        if self.is_sign(0, '{') {
            while !self.is_sign(0, '}') && self.at < self.tokens.len() {
                self.at += 1;
                if self.word_at(0).is_some() || self.is_sign(0, '{') || self.is_sign(0, '*') {
                    self.use_tree(&path, imports);
                }
            }
            self.at += 1;
        } else {
            let name = self.imported_name(&mut path);
            imports.push(Import { path, name, is_reexport: false, line });
        }
    }

    /// The name of what has just been read; `self` at the end of a path is the module before it.
    fn imported_name(&mut self, path: &mut Path) -> String {
        if self.is_sign(0, '*') {
            self.at += 1;
            return "*".to_owned();
        }
        // `path` has read `state as motion` up to `as`.
        if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        if self.word_at(0) == Some("as") {
            let name = self.word_at(1).unwrap_or("_").to_owned();
            self.at += 2;
            return name;
        }
        path.last().cloned().unwrap_or_default()
    }

    /// `#[cfg(test)]` or `#[cfg(all(test, …))]`.
    fn is_test_attribute(&self) -> bool {
        let words = [2, 4, 6].map(|offset| self.word_at(offset));
        matches!(words, [Some("cfg"), Some("test"), _] | [Some("cfg"), Some("all"), Some("test")])
    }

    /// Passes the attributes of an item and the item: up to its `;` or to the brace that closes it.
    fn skip_item(&mut self) {
        let mut depth = 0_usize;
        while let Some((token, _)) = self.tokens.get(self.at) {
            self.at += 1;
            match token {
                Token::Sign('(' | '[' | '{') => depth += 1,
                Token::Sign(')' | ']') => depth = depth.saturating_sub(1),
                Token::Sign('}') => {
                    depth = depth.saturating_sub(1);
                    if depth == 0 {
                        return;
                    }
                }
                Token::Sign(';') if depth == 0 => return,
                _ => {}
            }
        }
    }

    /// Passes everything up to this sign and the sign.
    fn skip_to(&mut self, sign: char) {
        while self.at < self.tokens.len() && !self.is_sign(0, sign) {
            self.at += 1;
        }
        self.at += 1;
    }

    fn take_separator(&mut self) -> bool {
        let is_there = matches!(self.tokens.get(self.at), Some((Token::PathSeparator, _)));
        self.at += usize::from(is_there);
        is_there
    }

    fn word_at(&self, offset: usize) -> Option<&str> {
        match self.tokens.get(self.at + offset) {
            Some((Token::Word(word), _)) => Some(word),
            _ => None,
        }
    }

    fn is_sign(&self, offset: usize, sign: char) -> bool {
        matches!(self.tokens.get(self.at + offset), Some((Token::Sign(there), _)) if *there == sign)
    }

    fn line(&self) -> usize {
        self.tokens.get(self.at).map_or(0, |(_, line)| *line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn imports(text: &str) -> Vec<(String, String)> {
        let imports = parse(text).remove(0).imports;
        imports.into_iter().map(|import| (import.path.join("::"), import.name)).collect()
    }

    fn pairs<const N: usize>(expected: [(&str, &str); N]) -> Vec<(String, String)> {
        expected.map(|(path, name)| (path.to_owned(), name.to_owned())).into()
    }

    #[test]
    fn every_name_of_a_nested_group_is_an_import() {
        let text = "use crate::{a, b::{c, d::*, self}, e::f as g};\nuse super::super::h;\nuse ::std::fmt;";
        let expected = pairs([
            ("crate::a", "a"),
            ("crate::b::c", "c"),
            ("crate::b::d", "*"),
            ("crate::b", "b"),
            ("crate::e::f", "g"),
            ("super::super::h", "h"),
        ]);
        assert_eq!(imports(text), expected);
    }

    #[test]
    fn reexports_of_any_visibility_are_marked() {
        let text = "pub use a::A; pub(crate) use b::B; pub(in crate::x) use c::C; use d::D;";
        let reexports = parse(text).remove(0).imports.into_iter().map(|import| import.is_reexport);
        assert_eq!(reexports.collect::<Vec<_>>(), [true, true, true, false]);
    }

    #[test]
    fn items_for_tests_are_left_out() {
        let text = "
            #[cfg(test)]
            mod tests;
            #[cfg(all(test, feature = \"net\"))]
            #[path = \"x.rs\"]
            mod inline { use crate::hidden; fn f() { crate::hidden::g(); } }
            #[cfg(test)]
            use crate::{hidden, other};
            #[cfg(feature = \"net\")]
            mod net;
            fn f() -> [u8; 2] { crate::seen::g() }";
        let module = parse(text).remove(0);
        assert!(module.imports.is_empty(), "{module:?}");
        assert_eq!(module.files_below, ["net"]);
        assert_eq!(
            module.mentions,
            [Mention { path: vec!["crate".into(), "seen".into(), "g".into()], line: 11 }]
        );
    }

    #[test]
    fn inline_modules_have_imports_of_their_own() {
        let modules = parse("use a::A; mod inner { use super::B; fn f() {} } fn g() { x::y() }");
        assert_eq!(modules.len(), 2);
        assert_eq!(
            (modules[1].place.as_slice(), modules[1].imports.len()),
            (["inner".to_owned()].as_slice(), 1)
        );
        assert!(modules[0].declared.contains("g") && modules[1].declared.contains("f"));
        assert_eq!(modules[0].mentions.len(), 1);
    }

    #[test]
    fn only_what_a_module_declares_itself_is_its_own() {
        let module = parse("pub(crate) struct A; impl A { fn method() {} } pub const B: u8 = 1;").remove(0);
        assert_eq!(module.declared.into_iter().collect::<Vec<_>>(), ["A", "B"]);
    }

    #[test]
    fn paths_of_other_crates_and_associated_items_are_not_taken_apart() {
        let text = "fn f() { ::std::mem::take(x); <T as crate::a::Trait>::Item::new(); $crate::b::C; }";
        let paths: Vec<_> = parse(text).remove(0).mentions.into_iter().map(|m| m.path.join("::")).collect();
        assert_eq!(paths, ["crate::a::Trait", "crate::b::C"]);
    }
}

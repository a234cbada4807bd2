//! The check on small trees that are made up: what it must find, and what it must let through.

use crate::check;
use crate::graph::Sources;
use crate::layers::Layers;

const PLAN: &str = "
# Map
```layers made-up/src
values              # the lowest
left, right
engine
```
";

/// The faults of a crate with these files, and with empty ones for the other parts of the plan.
fn faults(files: &[(&str, &str)]) -> Vec<String> {
    let mut sources = Sources::from([("lib.rs", "mod values; mod left; mod right; mod engine;")].map(owned));
    for part in ["values", "left", "right", "engine"] {
        let folder = format!("{part}/mod.rs");
        let is_folder = files.iter().any(|(name, _)| *name == folder);
        sources.insert(if is_folder { folder } else { format!("{part}.rs") }, String::new());
    }
    sources.extend(files.iter().copied().map(owned));
    check(&Layers::parse_all(PLAN).remove(0), &sources).expect("each module of the tree has a file")
}

fn owned((name, text): (&str, &str)) -> (String, String) {
    (name.to_owned(), text.to_owned())
}

#[test]
fn imports_from_lower_layers_are_let_through() {
    let engine = "use crate::{left::A, right::B, values::*}; fn f() { crate::values::make() }";
    assert_eq!(faults(&[("engine.rs", engine), ("left.rs", "use super::values::Value;")]), [""; 0]);
}

#[test]
fn an_upward_import_is_shown_with_its_place_and_both_layers() {
    let found = faults(&[("values.rs", "use std::fmt;\n\nuse crate::engine::Engine;")]);
    let expected = "made-up/src/values.rs:3 imports `crate::engine::Engine` (engine.rs): \
        values is in layer 1 (values), engine is above it in layer 3 (engine)";
    assert_eq!(found, [expected]);
}

#[test]
fn an_upward_path_in_code_is_found_as_one_in_a_use() {
    let found = faults(&[("values.rs", "fn f() -> u8 {\n  super::engine::size()\n}")]);
    assert!(found.len() == 1 && found[0].contains("values.rs:2 imports `super::engine::size`"), "{found:?}");
}

#[test]
fn parts_of_one_layer_may_not_import_each_other() {
    let found = faults(&[("left.rs", "use crate::right::B;")]);
    assert!(
        found.len() == 1 && found[0].contains("right is beside it in layer 2 (left, right)"),
        "{found:?}"
    );
}

#[test]
fn each_name_of_a_group_is_followed_by_itself() {
    let found = faults(&[("right.rs", "use crate::{values::{self, Value}, engine::{Engine, run as go}};")]);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found[0].contains("`crate::engine::Engine`") && found[1].contains("`crate::engine::run`"),
        "{found:?}"
    );
}

#[test]
fn super_super_is_followed_up_two_modules() {
    let files = [("left.rs", "mod deep;"), ("left/deep.rs", "use super::super::engine::Engine;")];
    let found = faults(&files);
    assert!(found.len() == 1 && found[0].contains("left/deep.rs:1"), "{found:?}");
}

#[test]
fn a_reexport_is_followed_to_the_file_that_defines_the_name() {
    let found = faults(&[
        ("lib.rs", "mod values; mod left; mod right; mod engine; pub use engine::*; pub use values::Value;"),
        ("engine/mod.rs", "mod parts; pub use parts::Piston as Part;"),
        ("engine/parts.rs", "pub struct Piston;"),
        ("values.rs", "pub struct Value;"),
        ("left.rs", "use crate::Value;"),
        ("right.rs", "use crate::Part;"),
    ]);
    assert!(
        found.len() == 1 && found[0].contains("right.rs:1 imports `crate::Part` (engine/parts.rs)"),
        "{found:?}"
    );
}

#[test]
fn a_path_that_begins_with_an_imported_module_is_followed_into_it() {
    let found = faults(&[
        ("left.rs", "use super::values as v; fn f() { v::inner::make() }"),
        ("values/mod.rs", "pub mod inner;"),
        ("values/inner.rs", "use crate::left;"),
    ]);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[1].contains("left.rs → values/inner.rs (line 1: v::inner::make) → left.rs"), "{found:?}");
}

#[test]
fn a_circle_within_a_folder_is_shown_with_its_lines() {
    let found = faults(&[
        ("left/mod.rs", "mod a; mod b;"),
        ("left/a.rs", "\nuse super::b::B;\npub struct A;"),
        ("left/b.rs", "pub struct B(super::a::A);"),
    ]);
    let circle = "left/a.rs → left/b.rs (line 2: super::b::B) → left/a.rs (line 1: super::a::A)";
    assert_eq!(found, [format!("made-up/src: circle {circle}")]);
}

#[test]
fn a_module_that_passes_on_what_is_below_does_not_depend_on_it() {
    let below = ("left/below.rs", "use super::Base; pub struct Below(Base);");
    assert_eq!(
        faults(&[("left/mod.rs", "mod below; pub use below::Below; pub struct Base;"), below]),
        [""; 0]
    );
    let uses_it = "mod below; pub use below::Below; pub struct Base; fn f() -> Below { todo!() }";
    let found = faults(&[("left/mod.rs", uses_it), below]);
    assert!(found.len() == 1 && found[0].contains("left/below.rs → left/mod.rs"), "{found:?}");
}

#[test]
fn tests_may_import_what_they_like() {
    let values = "#[cfg(test)]\nmod tests { use crate::engine::Engine; }\n#[cfg(test)]\nmod more;";
    assert_eq!(faults(&[("values.rs", values), ("values/more.rs", "use crate::engine::Engine;")]), [""; 0]);
}

#[test]
fn the_plan_names_what_is_there_and_nothing_else() {
    let root = "mod values; mod left; mod right; mod extra; #[cfg(test)] mod fixture;";
    let found = faults(&[("lib.rs", root), ("extra.rs", ""), ("fixture.rs", "")]);
    let expected = ["made-up/src: extra is in no layer", "made-up/src: engine is in the plan, and not there"];
    assert_eq!(found, expected);
}

#[test]
fn a_folder_within_a_crate_can_have_layers_of_its_own() {
    let plan = Layers::parse_all("\n```layers made-up/src/left\nlow\nhigh\n```").remove(0);
    assert_eq!(plan.source_folder(), "made-up/src");
    let sources = Sources::from(
        [
            ("lib.rs", "mod left; mod other;"),
            ("other.rs", "use crate::left::low;"),
            ("left/mod.rs", "mod low; mod high;"),
            ("left/low.rs", "use super::high::High; use crate::other::Other;"),
            ("left/high.rs", "struct High;"),
        ]
        .map(owned),
    );
    let found = check(&plan, &sources).unwrap();
    assert!(found[0].contains("made-up/src/left/low.rs:1 imports `super::high::High`"), "{found:?}");
    assert!(found.len() == 2 && found[1].contains("circle"), "{found:?}");
}

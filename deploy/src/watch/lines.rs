//! The page as plain lines: where standard output is no terminal, or one that cannot be written to at will.

use super::page::{Room, page};
use super::view::View;
use std::fmt::Write;
use v2x_common::time::Timestamp;

/// The page without styles, with an empty line after it.
pub(super) fn plain(view: &mut View, width: Option<usize>, now: Timestamp) -> String {
    let mut text = String::new();
    for line in page(view, Room { width, height: None }, now) {
        let _ = writeln!(text, "{}", line.to_string().trim_end());
    }
    text.push('\n');
    text
}

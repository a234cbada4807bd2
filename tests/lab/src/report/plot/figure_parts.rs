//! The parts of a figure, for a page that arranges them by its width: panels, each a drawing of its own, and one legend.

use crate::report::plot::sheet::Sheet;

/// How the panels are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// As many beside each other as can be read.
    Columns,
    /// The same with large panels.
    LargeColumns,
    /// One below the other.
    Rows,
}

/// The parts of a figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FigureParts {
    /// Its heading.
    pub title: String,
    /// What holds for all of it.
    pub subtitle: String,
    /// The panels with their captions, which may be empty.
    pub panels: Vec<(String, Sheet)>,
    /// Marks and what they are.
    pub legend: Vec<(Sheet, String)>,
    /// How the panels are arranged.
    pub layout: Layout,
}

//! The colours of every figure: Okabe and Ito's, which colour-blind readers can distinguish. Truth is blue, the first agent
//! vermilion, the second green; what is fused, and our method, has one colour everywhere. Agents and classes have the colours of
//! the live view (`deploy/web/js`), whose test computes how they look without one kind of cones.

/// A colour, `#rrggbb`.
pub(crate) type Colour = &'static str;

/// The ground truth.
pub(crate) const TRUTH: Colour = "#0072b2";
/// The inside of a true object.
pub(crate) const TRUTH_FILL: Colour = "#d6e6f2";
/// Fused objects and our method: Okabe and Ito's reddish purple, darker for enough contrast on white.
pub(crate) const OURS: Colour = "#b0467f";
/// Agents in their order.
pub(crate) const AGENTS: [Colour; 7] =
    ["#d55e00", "#009e73", "#de8e06", "#4aa8e0", "#43325a", "#989da2", "#615c04"];
/// Methods other than ours, and other series.
pub(crate) const SERIES: [Colour; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#a6761d", "#222222", "#999999"];

/// Insides of boxes by group of classes: cars, two-wheelers, people, what stands, the unknown. No line has such a colour.
pub(crate) const TINTS: [Colour; 5] = ["#ddf0d1", "#8bf9f2", "#f4fa9e", "#96b691", "#ffffff"];
/// The ground that vehicles use.
pub(crate) const ROAD: Colour = "#d2d5da";

/// Text and frames.
pub(crate) const INK: Colour = "#222222";
/// Axes and what is less important.
pub(crate) const MUTED: Colour = "#666666";
/// Lines of a grid.
pub(crate) const FAINT: Colour = "#dddddd";
/// Every second row.
pub(crate) const BAND: Colour = "#f2f4f7";
/// The background.
pub(crate) const PAPER: Colour = "#ffffff";

/// The key of our method.
const OURS_KEY: &str = "ours";

/// The colour of each of these methods, by key: ours has its own, the others follow one another.
pub(crate) fn of_methods<'a>(keys: impl IntoIterator<Item = &'a str>) -> Vec<Colour> {
    let mut others = SERIES.into_iter().cycle();
    keys.into_iter().filter_map(|key| if is_ours(key) { Some(OURS) } else { others.next() }).collect()
}

/// Whether this is the key of our method.
pub(crate) fn is_ours(key: &str) -> bool {
    key == OURS_KEY
}

/// Whether this is the key of our method or of a variant of it: `ours` is a part of its name.
pub(crate) fn is_of_ours(key: &str) -> bool {
    key.split('-').any(is_ours)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::{Path, PathBuf};

    #[test]
    fn ours_has_one_colour_wherever_it_stands_and_no_other_method_has_it() {
        assert_eq!(of_methods(["a", "ours", "b"]), [SERIES[0], OURS, SERIES[1]]);
        let many: Vec<_> = (0..30).map(|_| "other").collect();
        assert!(!of_methods(many).contains(&OURS) && !AGENTS.contains(&OURS));
    }

    #[test]
    fn variants_of_ours_are_known_by_name_and_no_other_method_is() {
        let variants = ["ours", "ours-lag-0.5s", "single-1-ours", "single-ours"];
        assert!(variants.into_iter().all(is_of_ours));
        assert!(!["nms", "csba-wls", "colours", "yours-2"].into_iter().any(is_of_ours));
    }

    #[test]
    fn agents_and_classes_have_the_colours_of_the_live_view() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy/web/js");
        let read = |name: &str| std::fs::read_to_string(page.join(name)).unwrap().to_lowercase();
        let list = |colours: &[Colour]| format!("\"{}\"", colours.join("\", \""));
        assert!(read("palette.js").contains(&list(&AGENTS)), "agents");
        // The unknown class has no colour there.
        assert!(read("classes.js").contains(&list(&TINTS[..4])), "classes");
    }

    fn sources(folder: &Path) -> Vec<PathBuf> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                found.extend(sources(&path));
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
        found
    }

    #[test]
    fn no_figure_has_a_colour_that_is_not_of_the_palette() {
        let report = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/report");
        let sources = sources(&report);
        assert!(sources.len() > 20, "{sources:?}");
        for path in sources {
            let is_excepted = ["palette.rs", "page.rs", "tests.rs"].iter().any(|name| path.ends_with(name));
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            let is_hex =
                |colour: &str| colour.len() == 6 && colour.bytes().all(|byte| byte.is_ascii_hexdigit());
            let found = code.split('#').skip(1).find(|rest| rest.get(..6).is_some_and(is_hex));
            assert!(is_excepted || found.is_none(), "{}: #{}", path.display(), found.unwrap_or_default());
        }
    }
}

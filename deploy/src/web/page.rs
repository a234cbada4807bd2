//! The files of the page, which are part of the program.

/// A file of the page.
#[derive(Debug)]
pub(super) struct File {
    pub(super) content_type: &'static str,
    pub(super) bytes: &'static [u8],
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const JS: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

macro_rules! files {
    ($($path:literal, $content_type:ident, $file:literal;)*) => {
        /// The file under a path.
        pub(super) fn file(path: &str) -> Option<File> {
            match path {
                $($path => Some(File {
                    content_type: $content_type,
                    bytes: include_bytes!(concat!("../../web/", $file)),
                }),)*
                _ => None,
            }
        }

        /// The paths of all files.
        #[cfg(test)]
        const PATHS: &[(&str, &str)] = &[$(($path, $file)),*];
    };
}

files! {
    "/", HTML, "index.html";
    "/style.css", CSS, "style.css";
    "/icon.svg", SVG, "icon.svg";
    "/js/main.js", JS, "js/main.js";
    "/js/agents.js", JS, "js/agents.js";
    "/js/camera.js", JS, "js/camera.js";
    "/js/charts.js", JS, "js/charts.js";
    "/js/classes.js", JS, "js/classes.js";
    "/js/feed.js", JS, "js/feed.js";
    "/js/frames.js", JS, "js/frames.js";
    "/js/gestures.js", JS, "js/gestures.js";
    "/js/hubs.js", JS, "js/hubs.js";
    "/js/keyboard.js", JS, "js/keyboard.js";
    "/js/labels.js", JS, "js/labels.js";
    "/js/layers.js", JS, "js/layers.js";
    "/js/legend.js", JS, "js/legend.js";
    "/js/marks.js", JS, "js/marks.js";
    "/js/nodes.js", JS, "js/nodes.js";
    "/js/palette.js", JS, "js/palette.js";
    "/js/panel.js", JS, "js/panel.js";
    "/js/picking.js", JS, "js/picking.js";
    "/js/probe.js", JS, "js/probe.js";
    "/js/readout.js", JS, "js/readout.js";
    "/js/scene.js", JS, "js/scene.js";
    "/js/series.js", JS, "js/series.js";
    "/js/shapes.js", JS, "js/shapes.js";
    "/js/store.js", JS, "js/store.js";
    "/js/timeline.js", JS, "js/timeline.js";
    "/js/timing.js", JS, "js/timing.js";
    "/js/truth.js", JS, "js/truth.js";
    "/js/verdict.js", JS, "js/verdict.js";
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn every_file_of_the_page_is_served() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        let mut there = BTreeSet::new();
        for below in ["", "js/"] {
            for entry in std::fs::read_dir(folder.join(below)).unwrap() {
                let entry = entry.unwrap();
                if entry.path().is_file() {
                    there.insert(format!("{below}{}", entry.file_name().to_string_lossy()));
                }
            }
        }
        let served: BTreeSet<_> = PATHS.iter().map(|(_, file)| (*file).to_owned()).collect();
        assert_eq!(served, there);
    }

    #[test]
    fn nothing_is_loaded_from_elsewhere() {
        for (path, _) in PATHS {
            let file = file(path).unwrap();
            let text = String::from_utf8_lossy(file.bytes);
            let text = text.replace("http://www.w3.org/2000/svg", "");
            assert!(
                !text.contains("http://") && !text.contains("https://") && !text.contains("//cdn"),
                "{path}"
            );
        }
    }
}

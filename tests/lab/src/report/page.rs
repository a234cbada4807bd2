//! A self-contained HTML page: no scripts, external style sheets or pictures. It is read on a telephone, in the dark, and on
//! paper.

use crate::report::table::escaped;

const STYLE: &str = "\
:root { color-scheme: light dark; --ink: #222; --paper: #fff; --muted: #555; --line: #e0e0e0; --accent: #0072b2; \
--ours: #b0467f; --mark: #f9edf4; --soft: #f3f4f6; --good: #00724f; --bad: #b34700; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e6e6; --paper: #15171b; --muted: #a8a8a8; --line: #343840; \
--accent: #56b4e9; --ours: #cc79a7; --mark: #35242e; --soft: #22252b; --good: #2fc494; --bad: #ff8c42; } }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 0 auto; max-width: 1400px; padding: 1rem clamp(.8rem, 3vw, 2rem) 4rem; overflow-wrap: break-word; }
h1 { font-size: 1.7rem; line-height: 1.25; } h2 { font-size: 1.3rem; margin-top: 2.5rem; border-bottom: 2px solid var(--accent); }
h3 { font-size: 1.05rem; margin-bottom: .3rem; }
nav a { margin-right: 1rem; } a { color: var(--accent); }
.verdict { border-left: 6px solid var(--ours); background: var(--soft); padding: .7rem 1rem; margin: 1rem 0; }
.verdict b { font-size: 1.25rem; margin-right: .6rem; } .verdict.good { border-color: var(--good); } .verdict.good b { color: var(--good); }
.verdict.bad { border-color: var(--bad); } .verdict.bad b { color: var(--bad); }
.table { overflow-x: auto; max-width: 100%; } table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 9px; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0; background: var(--paper); }
thead th { border-bottom: 2px solid var(--muted); }
tr.marked td { background: var(--mark); font-weight: 600; } tr.marked td:first-child { box-shadow: inset 4px 0 var(--ours); }
.words td { white-space: normal; text-align: left; }
figure { margin: 1rem 0; overflow-x: auto; } figure svg { display: block; width: 100%; min-width: 620px; height: auto; border: 1px solid var(--line); }
figcaption { font-size: 13px; color: var(--muted); position: sticky; left: 0; }
pre { background: var(--soft); padding: .6rem .8rem; overflow-x: auto; font-size: 13px; }
details { margin: .4rem 0; } summary { cursor: pointer; color: var(--accent); } .notes { font-size: 13px; color: var(--muted); padding-left: 1.2rem; }
@media print { body { max-width: none; padding: 0; font-size: 11px; } .table, figure { overflow: visible; } figure svg { min-width: 0; } \
th:first-child, td:first-child { position: static; } figure, tr, .verdict { break-inside: avoid; } h2, h3 { break-after: avoid; } nav { display: none; } }
";

/// A page with this title and body, which is HTML.
pub(crate) fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
         <style>\n{STYLE}</style></head>\n<body>\n{body}</body>\n</html>\n",
        escaped(title)
    )
}

/// The verdict, which stands before everything else.
pub(crate) fn verdict_html(is_good: bool, verdict: &str, reasons: &str) -> String {
    let class = if is_good { "good" } else { "bad" };
    format!("<p class=\"verdict {class}\"><b>{}</b>{}</p>\n", escaped(verdict), escaped(reasons))
}

/// A figure as wide as the page; where that is too narrow to read, it scrolls within its own box. With the name of its
/// files, if it has some.
pub(crate) fn figure(svg: &str, file: Option<&str>) -> String {
    let caption = file.map_or_else(String::new, |name| {
        format!(
            "<figcaption>plots/{name}.svg, <a href=\"plots/{name}.pdf\">plots/{name}.pdf</a></figcaption>"
        )
    });
    // Not so wide that its text is much larger than the page's.
    let width = svg.split("width=\"").nth(1).and_then(|rest| rest.split('"').next()?.parse::<u32>().ok());
    let limit = width.map_or_else(String::new, |width| format!(" style=\"max-width: {}px\"", width * 3 / 2));
    format!("<figure><div{limit}>\n{svg}</div>{caption}</figure>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_at_most_half_as_wide_again_as_it_was_drawn() {
        let html = figure("<svg viewBox=\"0 0 600 100\" width=\"600\" height=\"100\"></svg>", Some("error"));
        assert!(html.contains("max-width: 900px") && html.contains("plots/error.pdf"), "{html}");
    }

    #[test]
    fn the_verdict_is_escaped_and_has_its_colour() {
        let html = verdict_html(false, "Not passed", "a < b");
        assert!(html.contains("verdict bad") && html.contains("a &lt; b"), "{html}");
    }
}

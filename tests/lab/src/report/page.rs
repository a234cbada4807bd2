//! A self-contained HTML page: no scripts, external style sheets or pictures.

use crate::report::table::escaped;

const STYLE: &str = "\
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto; max-width: 1500px; padding: 1rem 1.5rem 4rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.3rem; margin-top: 2.5rem; border-bottom: 2px solid #0072b2; }
h3 { font-size: 1.05rem; margin-bottom: .3rem; }
nav a { margin-right: 1rem; } a { color: #0072b2; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 2px 9px; text-align: right; white-space: nowrap; border-bottom: 1px solid #e4e4e4; }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0; background: #fff; }
thead th { border-bottom: 2px solid #888; } tr.marked td { background: #eaf3fa; font-weight: 600; }
figure { margin: 1rem 0; overflow-x: auto; } figure svg { max-width: 100%; height: auto; } figcaption { font-size: 13px; color: #555; }
pre { background: #f5f6f8; padding: .6rem .8rem; overflow-x: auto; font-size: 13px; }
details { margin: .4rem 0; } summary { cursor: pointer; color: #0072b2; }
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

//! The page as styled lines that fit a window; without their styles they are the plain output.

use super::objects::{Column, ObjectTable, Order, shortened};
use super::roster::AgentRow;
use super::view::{HubView, View};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use v2x_common::fused::FusedObject;
use v2x_common::id::AgentId;
use v2x_common::time::{Span as TimeSpan, Timestamp};

/// Time without a fused frame after which the page says so; a hub publishes ten times a second.
const SILENCE: TimeSpan = TimeSpan::from_millis(3_000);
/// An object that was last measured longer ago is written dim.
const COASTING: TimeSpan = TimeSpan::from_millis(500);
/// The project's colours of agents, as the nearest of a terminal's 256: vermilion, green, orange, sky blue, brown.
const AGENT_COLOURS: [Color; 5] =
    [Color::Indexed(166), Color::Indexed(36), Color::Indexed(178), Color::Indexed(74), Color::Indexed(137)];
const BAD: Color = Color::Indexed(166);
/// Least room for the text of a refusal in its agent's line.
const LEAST_REASON: usize = 30;

const BOLD: Style = Style::new().add_modifier(Modifier::BOLD);
const DIM: Style = Style::new().add_modifier(Modifier::DIM);

/// The room of a page, in characters; without a limit where it is `None`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    pub(super) width: Option<usize>,
    pub(super) height: Option<usize>,
}

/// The page; keeps in the view how many objects had room.
pub(super) fn page(view: &mut View, room: Room, now: Timestamp) -> Vec<Line<'static>> {
    let now = view.paused_at.unwrap_or(now);
    let Some(hub) = view.hub() else {
        return vec![Line::from("no fused frame yet")];
    };
    let mut lines = header(view, hub, room.width, now);
    let agents = hub.roster.rows(now);
    let budget = room.height.map(|height| height.saturating_sub(lines.len() + 5) / 3);
    lines.push(Line::default());
    lines.extend(agent_lines(&agents, room.width, budget.map(|rows| rows.max(1)), now));
    lines.push(Line::default());
    // A line for the titles, one for what has no room.
    let page = room.height.map(|height| height.saturating_sub(lines.len() + 2));
    let order = view.order;
    let (table, offset) = object_lines(hub, order, (view.offset, page), room.width);
    lines.extend(table);
    view.page = page.unwrap_or(usize::MAX);
    view.offset = offset;
    lines
}

/// The parts, in as many lines as they need.
fn header(view: &View, hub: &HubView, width: Option<usize>, now: Timestamp) -> Vec<Line<'static>> {
    let frame = &hub.frame;
    let mut parts = vec![
        Span::styled(frame.hub.to_string(), BOLD),
        Span::raw(count(frame.objects.len(), "object")),
        Span::raw(format!("frame {}", frame.sequence)),
    ];
    if let Some(newest) = frame.agents.iter().map(|health| health.newest_captured_at).max() {
        parts.push(Span::raw(format!("newest measurement {} ago", age(now - newest))));
    }
    if let Some((p50, p95)) =
        hub.status.as_ref().and_then(|status| status.latency_ms.p50.zip(status.latency_ms.p95))
    {
        parts.push(Span::raw(format!("hub latency {p50:.1} ms, p95 {p95:.1} ms")));
    }
    if now - hub.received_at > SILENCE {
        let silence = age(now - hub.received_at);
        let style = Style::new().fg(BAD).add_modifier(Modifier::BOLD);
        parts.push(Span::styled(format!("no fused frame for {silence}; is the hub still there?"), style));
    }
    if let (place, n_hubs @ 2..) = view.place() {
        parts.push(Span::raw(format!("hub {place} of {n_hubs}")));
    }
    if view.paused_at.is_some() {
        parts.push(Span::styled("paused", BOLD));
    }
    flow(parts, width)
}

fn flow(parts: Vec<Span<'static>>, width: Option<usize>) -> Vec<Line<'static>> {
    let mut lines = vec![Line::default()];
    for part in parts {
        let used = lines.last().map_or(0, Line::width);
        let is_full = width.is_some_and(|width| used + 3 + part.width() > width);
        match lines.last_mut() {
            Some(line) if used > 0 && !is_full => {
                line.push_span(Span::styled(" · ", DIM));
                line.push_span(part);
            }
            Some(line) if used == 0 => line.push_span(part),
            _ => lines.push(Line::from(part)),
        }
    }
    lines
}

/// A line for each agent, at most `budget` of them and one for the others.
fn agent_lines(
    agents: &[&AgentRow],
    width: Option<usize>,
    budget: Option<usize>,
    now: Timestamp,
) -> Vec<Line<'static>> {
    let names = agents.iter().map(|row| row.id.as_str().len()).max().unwrap_or(0).max(5);
    // Of a narrow window a name has what the counts leave.
    let names = width.map_or(names, |width| names.min(width.saturating_sub(COUNTS_WIDTH).max(5)));
    let mut titles =
        format!("{:<names$} {:>8} {:>6} {:>7} {:>8}", "agent", "accepted", "late", "refused", "newest");
    if width.is_none_or(|width| width >= titles.chars().count() + LEAST_REASON) {
        titles.push_str("  last refusal");
    }
    let mut lines = vec![Line::styled(titles, BOLD)];
    let mut shown = 0;
    for (place, row) in agents.iter().enumerate() {
        let of_row = agent_row(row, place, (names, width), now);
        // The line that counts the others has room for the last of them as well.
        let is_last = place + 1 == agents.len() && of_row.len() == 1;
        let room =
            budget.is_none_or(|budget| lines.len() - 1 + of_row.len() <= budget) || place == 0 || is_last;
        if !room {
            break;
        }
        lines.extend(of_row);
        shown += 1;
    }
    let left = &agents[shown..];
    if !left.is_empty() {
        let refused = left.iter().filter(|row| row.is_refused(now)).count();
        let refused = if refused > 0 { format!(", {refused} of them refused now") } else { String::new() };
        lines.push(Line::styled(format!("… and {}{refused}", count(left.len(), "more agent")), DIM));
    }
    lines
}

const COUNTS_WIDTH: usize = 1 + 8 + 1 + 6 + 1 + 7 + 1 + 8;

/// An agent's line; where the refusal has no room in it, a second one.
fn agent_row(
    row: &AgentRow,
    place: usize,
    (names, width): (usize, Option<usize>),
    now: Timestamp,
) -> Vec<Line<'static>> {
    let newest = row.newest.map_or_else(|| "–".to_owned(), |newest| age(now - newest));
    let refused =
        if row.is_refused(now) { Style::new().fg(BAD).add_modifier(Modifier::BOLD) } else { Style::new() };
    let mut line = Line::from(vec![
        Span::styled(format!("{:<names$}", shortened(row.id.as_str(), names)), agent_style(place)),
        Span::raw(format!(" {:>8} {:>6} ", row.accepted, row.late)),
        Span::styled(format!("{:>7}", row.refused), refused),
        Span::raw(format!(" {newest:>8}")),
    ]);
    let Some(reason) = &row.last_refusal else {
        return vec![line];
    };
    let style = if row.is_refused(now) { refused } else { DIM };
    let left = width.map_or(usize::MAX, |width| width.saturating_sub(line.width() + 2));
    if reason.chars().count() <= left || left >= LEAST_REASON {
        line.push_span(Span::styled(format!("  {}", shortened(reason, left)), style));
        return vec![line];
    }
    let below = shortened(&format!("  {reason}"), width.unwrap_or(usize::MAX));
    vec![line, Line::styled(below, style)]
}

/// The titles, the objects from an offset on, and a line for those without room; with the offset that was possible.
fn object_lines(
    hub: &HubView,
    order: Order,
    (offset, page): (usize, Option<usize>),
    width: Option<usize>,
) -> (Vec<Line<'static>>, usize) {
    let objects = order.sorted(&hub.frame.objects);
    let page = page.unwrap_or(objects.len());
    let offset = offset.min(objects.len().saturating_sub(page));
    let shown = &objects[offset..objects.len().min(offset + page)];
    let table = ObjectTable::fit(shown, width);
    let mut lines = vec![titles(&table, order)];
    let places: Vec<_> = hub.frame.agents.iter().map(|health| health.agent).collect();
    for (object, cells) in shown.iter().zip(&table.rows) {
        lines.push(object_row(object, cells, (&table, &places), hub.frame.fused_at));
    }
    let (above, below) = (offset, objects.len() - offset - shown.len());
    match (above, below) {
        (0, 0) => {}
        (0, below) => lines.push(Line::styled(format!("… and {below} more"), DIM)),
        (above, below) => lines.push(Line::styled(format!("… {above} above, {below} below"), DIM)),
    }
    (lines, offset)
}

fn titles(table: &ObjectTable, order: Order) -> Line<'static> {
    let mut line = Line::default();
    for (column, width) in &table.columns {
        let is_sorted = column.sort_key() == Some(order.key);
        let title: String = column.title().chars().take(*width).collect();
        let style = if is_sorted { BOLD.add_modifier(Modifier::UNDERLINED) } else { BOLD };
        push_cell(&mut line, &title, (*column, *width), style);
    }
    line
}

fn object_row(
    object: &FusedObject,
    cells: &[String],
    (table, agents): (&ObjectTable, &[AgentId]),
    fused_at: Timestamp,
) -> Line<'static> {
    let style = if fused_at - object.last_measured_at > COASTING { DIM } else { Style::new() };
    let mut line = Line::default();
    for ((column, width), cell) in table.columns.iter().zip(cells) {
        if *column != Column::Agents {
            push_cell(&mut line, cell, (*column, *width), style);
            continue;
        }
        let mut left = *width;
        for contributor in &object.contributors {
            let place = agents.iter().position(|agent| *agent == contributor.frame.agent).unwrap_or(0);
            let name = shortened(contributor.frame.agent.as_str(), left);
            left = left.saturating_sub(name.chars().count() + 1);
            line.push_span(Span::raw(if line.spans.is_empty() { "" } else { " " }));
            line.push_span(Span::styled(name, agent_style(place).patch(style)));
        }
    }
    line
}

fn push_cell(line: &mut Line<'static>, text: &str, (column, width): (Column, usize), style: Style) {
    if !line.spans.is_empty() {
        line.push_span(Span::raw(" "));
    }
    let padded = if column.is_text() { format!("{text:<width$}") } else { format!("{text:>width$}") };
    line.push_span(Span::styled(padded, style));
}

const fn agent_style(place: usize) -> Style {
    Style::new().fg(AGENT_COLOURS[place % AGENT_COLOURS.len()])
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// A span of time in at most eight characters.
fn age(span: TimeSpan) -> String {
    let seconds = span.as_secs_f64();
    match seconds.abs() {
        below if below < 10.0 => format!("{:.0} ms", seconds * 1e3),
        below if below < 600.0 => format!("{seconds:.0} s"),
        below if below < 36_000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.0} h", seconds / 3600.0),
    }
}

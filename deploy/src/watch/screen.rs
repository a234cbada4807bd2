//! The terminal while the live table is shown.

use super::page::{Room, page};
use super::view::{Action, View};
use anyhow::Context;
use ratatui::DefaultTerminal;
use ratatui::Frame;
use ratatui::crossterm::event::{self, Event};
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;
use std::ffi::OsStr;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use v2x_common::clock;
use v2x_common::net::logging;
use v2x_common::time::Timestamp;

/// Keys that may wait.
const KEYS_CAPACITY: usize = 64;
/// How long the reader of keys waits before it looks whether it is still wanted.
const KEY_PATIENCE: Duration = Duration::from_millis(50);

/// Whether the live table can be shown: it needs a terminal that can be written to at will, and its keys.
pub(super) fn is_possible() -> bool {
    let is_dumb = std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == OsStr::new("dumb"));
    std::io::stdout().is_terminal() && std::io::stdin().is_terminal() && !is_dumb
}

/// The width of standard output in characters, if it is a terminal.
pub(super) fn width() -> Option<usize> {
    if !std::io::stdout().is_terminal() {
        return None;
    }
    ratatui::crossterm::terminal::size()
        .ok()
        .map(|(columns, _)| usize::from(columns))
        .filter(|width| *width > 0)
}

/// The terminal in our hands. Dropping it gives it back as it was; so does a panic.
pub(super) struct Screen {
    terminal: DefaultTerminal,
    events: Receiver<Event>,
    reader: Option<JoinHandle<()>>,
    is_over: Arc<AtomicBool>,
    in_colour: bool,
    _logs: logging::Held,
}

impl Screen {
    /// Takes the terminal.
    pub(super) fn open() -> anyhow::Result<Self> {
        let logs = logging::hold();
        let terminal = ratatui::try_init().context("preparing the terminal; TERM=dumb prints plain lines")?;
        let is_over = Arc::new(AtomicBool::new(false));
        let (sender, events) = channel(KEYS_CAPACITY);
        // A thread: reading a terminal cannot be cancelled.
        let reader = std::thread::spawn({
            let is_over = is_over.clone();
            move || read_events(&sender, &is_over)
        });
        let reader = Some(reader);
        Ok(Self { terminal, events, reader, is_over, in_colour: logging::wants_colour(), _logs: logs })
    }

    /// Draws the view.
    pub(super) fn draw(&mut self, view: &mut View) -> anyhow::Result<()> {
        let in_colour = self.in_colour;
        let drawn = self.terminal.draw(|frame| draw(frame, view, clock::now(), in_colour));
        drawn.context("writing to the terminal").map(|_| ())
    }

    /// Forgets what the terminal shows, so that all of it is drawn again.
    pub(super) fn clear(&mut self) -> anyhow::Result<()> {
        self.terminal.clear().context("clearing the terminal")
    }

    /// What the next key asks for. Cancel-safe.
    pub(super) async fn next(&mut self) -> Action {
        loop {
            match self.events.recv().await {
                Some(event) => {
                    if let Some(action) = Action::of(&event) {
                        return action;
                    }
                }
                // The terminal has no more keys: it is gone.
                None => return Action::Quit,
            }
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        // Joined before the terminal is given back, so that it takes no key of the shell's.
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
        ratatui::restore();
    }
}

fn read_events(sender: &Sender<Event>, is_over: &AtomicBool) {
    while !is_over.load(Ordering::Relaxed) {
        let event = match event::poll(KEY_PATIENCE) {
            Ok(false) => continue,
            Ok(true) => event::read(),
            Err(error) => Err(error),
        };
        // Where nobody takes keys fast enough the newest is lost; the next one is not.
        match event.map(|event| sender.try_send(event)) {
            Ok(_) => {}
            Err(_) => return,
        }
    }
}

/// The page, and the keys below it.
pub(super) fn draw(frame: &mut Frame<'_>, view: &mut View, now: Timestamp, in_colour: bool) {
    let area = frame.area();
    let footer = Rect { y: area.bottom().saturating_sub(1), height: area.height.min(1), ..area };
    let body = Rect { height: area.height.saturating_sub(1), ..area };
    let room = Room { width: Some(body.width.into()), height: Some(body.height.into()) };
    frame.render_widget(Paragraph::new(page(view, room, now)), body);
    frame.render_widget(keys(view, footer.width.into()), footer);
    if !in_colour {
        for cell in &mut frame.buffer_mut().content {
            (cell.fg, cell.bg) = (Color::Reset, Color::Reset);
        }
    }
}

/// As many of the keys as have room.
fn keys(view: &View, width: usize) -> Line<'static> {
    let direction = if view.order.is_descending() { "↓" } else { "↑" };
    let pause = if view.paused_at.is_some() { "p go on" } else { "p pause" };
    let sort = format!("s sort: {} {direction}", view.order.key.name());
    let mut text = "q quit".to_owned();
    for key in [sort.as_str(), "r reverse", "↑↓ PgUp PgDn scroll", pause, "Tab next hub"] {
        if key.starts_with("Tab") && view.place().1 < 2 {
            continue;
        }
        if text.chars().count() + 3 + key.chars().count() <= width {
            text = text + " · " + key;
        }
    }
    Line::styled(format!("{text:<width$}"), Style::new().add_modifier(Modifier::REVERSED))
}

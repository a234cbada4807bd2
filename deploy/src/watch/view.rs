//! What the terminal shows: the newest frame and status of each hub, and what the user has chosen.

use super::objects::{Order, SortKey};
use super::roster::Roster;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use std::collections::BTreeMap;
use v2x_common::fused::FusedFrame;
use v2x_common::id::HubId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::HubStatus;

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Quit,
    NextSort,
    Reverse,
    NextHub,
    Pause,
    Up,
    Down,
    PageUp,
    PageDown,
    First,
    Last,
    Redraw,
}

impl Action {
    /// What an event of the terminal asks for, if anything.
    pub(super) fn of(event: &Event) -> Option<Self> {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => Self::of_key(*key),
            Event::Resize(..) => Some(Self::Redraw),
            _ => None,
        }
    }

    fn of_key(key: KeyEvent) -> Option<Self> {
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        Some(match key.code {
            KeyCode::Char('c' | 'd') if is_control => Self::Quit,
            KeyCode::Char('l') if is_control => Self::Redraw,
            KeyCode::Char(_) if is_control => return None,
            KeyCode::Char('q') | KeyCode::Esc => Self::Quit,
            KeyCode::Char('s') => Self::NextSort,
            KeyCode::Char('r') => Self::Reverse,
            KeyCode::Char('p') => Self::Pause,
            KeyCode::Tab => Self::NextHub,
            KeyCode::Up | KeyCode::Char('k') => Self::Up,
            KeyCode::Down | KeyCode::Char('j') => Self::Down,
            KeyCode::PageUp | KeyCode::Char('b') => Self::PageUp,
            KeyCode::PageDown | KeyCode::Char(' ' | 'f') => Self::PageDown,
            KeyCode::Home | KeyCode::Char('g') => Self::First,
            KeyCode::End | KeyCode::Char('G') => Self::Last,
            _ => return None,
        })
    }
}

/// What is known of one hub.
#[derive(Clone, Debug)]
pub(super) struct HubView {
    pub(super) frame: FusedFrame,
    /// When the frame came, by this machine's clock.
    pub(super) received_at: Timestamp,
    pub(super) status: Option<HubStatus>,
    pub(super) roster: Roster,
}

/// Everything that is shown.
#[derive(Clone, Debug, Default)]
pub(super) struct View {
    hubs: BTreeMap<HubId, HubView>,
    shown: Option<HubId>,
    pub(super) order: Order,
    /// The first object that is shown.
    pub(super) offset: usize,
    /// How many objects had room when they were drawn last.
    pub(super) page: usize,
    /// Since when the picture stands still, if it does.
    pub(super) paused_at: Option<Timestamp>,
}

impl View {
    pub(super) fn new(key: SortKey) -> Self {
        Self { order: Order { key, is_reversed: false }, ..Self::default() }
    }

    /// Takes a fused frame, unless the picture is paused.
    pub(super) fn take_frame(&mut self, frame: FusedFrame, now: Timestamp) {
        if self.paused_at.is_some() {
            return;
        }
        let id = frame.hub;
        match self.hubs.get_mut(&id) {
            Some(hub) => {
                hub.roster.take_frame(&frame, now);
                (hub.frame, hub.received_at) = (frame, now);
            }
            None => {
                let mut roster = Roster::default();
                roster.take_frame(&frame, now);
                self.hubs.insert(id, HubView { frame, received_at: now, status: None, roster });
            }
        }
        self.shown = self.shown.or(Some(id));
    }

    /// Takes the answers to a query of status.
    pub(super) fn take_statuses(&mut self, statuses: Vec<HubStatus>, now: Timestamp) {
        for status in statuses.into_iter().filter(|_| self.paused_at.is_none()) {
            if let Some(hub) = self.hubs.get_mut(&status.hub) {
                hub.roster.take_status(&status, now);
                hub.status = Some(status);
            }
        }
    }

    /// Chooses the hub that is shown.
    pub(super) const fn show(&mut self, hub: HubId) {
        self.shown = Some(hub);
    }

    /// The hub that is shown.
    pub(super) fn hub(&self) -> Option<&HubView> {
        self.hubs.get(self.shown.as_ref()?)
    }

    /// Its place among all hubs, from 1, and their number.
    pub(super) fn place(&self) -> (usize, usize) {
        let place = self.hubs.keys().position(|id| Some(*id) == self.shown).unwrap_or(0);
        (place + 1, self.hubs.len())
    }

    /// Does what a key asks for; ending is the caller's.
    pub(super) fn act(&mut self, action: Action, now: Timestamp) {
        match action {
            Action::NextSort => {
                self.order = Order { key: self.order.key.next(), is_reversed: false };
                self.offset = 0;
            }
            Action::Reverse => {
                self.order.is_reversed = !self.order.is_reversed;
                self.offset = 0;
            }
            Action::NextHub => {
                let after = self.hubs.keys().find(|id| Some(**id) > self.shown);
                self.shown = after.or_else(|| self.hubs.keys().next()).copied();
                self.offset = 0;
            }
            Action::Pause => self.paused_at = if self.paused_at.is_none() { Some(now) } else { None },
            Action::Up => self.offset = self.offset.saturating_sub(1),
            Action::Down => self.offset += 1,
            Action::PageUp => self.offset = self.offset.saturating_sub(self.page.max(1)),
            Action::PageDown => self.offset += self.page.max(1),
            Action::First => self.offset = 0,
            Action::Last => self.offset = usize::MAX,
            Action::Quit | Action::Redraw => {}
        }
        let n_objects = self.hub().map_or(0, |hub| hub.frame.objects.len());
        self.offset = self.offset.min(n_objects.saturating_sub(self.page.max(1)));
    }
}

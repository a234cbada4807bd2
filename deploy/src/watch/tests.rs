//! The live table at several sizes of the window.

use super::lines::plain;
use super::objects::SortKey;
use super::screen::draw;
use super::view::{Action, View};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::Color;
use v2x_common::class::Class;
use v2x_common::fused::{AgentHealth, FusedFrame, FusedObject};
use v2x_common::geometry::BevBox;
use v2x_common::id::{AgentId, FrameId, HubId, MeasurementId, TrackId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_fusion_hub::hub::HubStatus;

const REFUSAL: &str = "captured 1203.100 ms before the hub's time: too late";

fn now() -> Timestamp {
    Timestamp::from_micros(1_795_314_000_000_000).unwrap()
}

fn agent(name: &str) -> AgentId {
    AgentId::new(name).unwrap()
}

fn health(name: &str, accepted: u64, refused: u64) -> AgentHealth {
    AgentHealth {
        agent: agent(name),
        epoch: 1,
        newest_captured_at: now() + Span::from_millis(-43),
        accepted,
        refused,
        out_of_sequence: 18,
    }
}

/// Object 0 is the slowest and the newest measured, object n the fastest.
fn object(number: u32) -> FusedObject {
    let class = if number.is_multiple_of(2) { Class::Car } else { Class::Adult };
    let bev = BevBox { x: f64::from(number) * -3.25 - 0.001, y: 112.5, w: 1.9, d: 4.6, yaw: 1.0 };
    let mut object = FusedObject::from_box(TrackId::new(3_000_000_000, number + 1), class, bev);
    object.velocity = (f64::from(number), 0.0);
    object.last_measured_at = now();
    object.contributors = ["ego", "rsu"]
        .map(|name| MeasurementId { frame: FrameId { agent: agent(name), epoch: 1, sequence: 7 }, index: 0 })
        .into();
    object
}

fn frame(hub: &str, n_objects: u32) -> FusedFrame {
    FusedFrame {
        hub: HubId::new(hub).unwrap(),
        lineage: 3_000_000_000,
        sequence: 1234,
        fused_at: now(),
        map_frame: None,
        objects: (0..n_objects).map(object).collect(),
        agents: vec![health("ego", 197, 0), health("rsu", 195, 34)],
        includes: Vec::new(),
    }
}

fn agent_status(name: &str, is_alive: bool, refused: u64) -> serde_json::Value {
    let last_refusal = (refused > 0).then_some(REFUSAL);
    serde_json::json!({
        "id": name, "alive": is_alive, "accepted": 0, "synchronous": 0, "out_of_sequence": 0, "ahead_of_time": 0,
        "refused": { "too_late": refused }, "last_refusal": last_refusal, "unmapped_classes": 0,
        "descriptions_refused": 0, "nis_per_dof": null, "newest_captured_at": null, "sensor": null,
    })
}

fn status(agents: &[serde_json::Value]) -> HubStatus {
    let quantiles = serde_json::json!({ "p50": 0.71, "p95": 1.38, "p99": 3.0, "max": 4.0, "count": 9 });
    let status = serde_json::json!({
        "hub": "hub", "network": "demo", "version": "0", "lineage": 3_000_000_000_u32, "started_at": 0, "now": 0,
        "locators": [], "tracks": 0, "objects": 0, "frames_published": 0, "publish_errors": 0, "dropped_overload": 0,
        "refused_beyond_limit": 0, "refused_unnamed": 0, "births_refused": 0, "merges": 0, "objects_withheld": 0,
        "latency_ms": quantiles, "compute_ms": quantiles, "memory_bytes": null, "agents": agents,
    });
    serde_json::from_value(status).unwrap()
}

/// A hub with two agents, one of which is refused.
fn view(n_objects: u32) -> View {
    let mut view = View::new(SortKey::Track);
    view.take_frame(frame("hub", n_objects), now());
    let agents = [agent_status("ego", true, 0), agent_status("rsu", true, 34)];
    view.take_statuses(vec![status(&agents)], now());
    view
}

struct Drawn {
    lines: Vec<String>,
    colours: Vec<Color>,
}

impl Drawn {
    fn has(&self, text: &str) -> bool {
        self.lines.iter().any(|line| line.contains(text))
    }
}

fn drawn(view: &mut View, (width, height): (u16, u16), in_colour: bool) -> Drawn {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(frame, view, now(), in_colour)).unwrap();
    let buffer = terminal.backend().buffer();
    let rows = buffer.content.chunks(usize::from(width));
    let lines =
        rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned());
    Drawn { lines: lines.collect(), colours: buffer.content.iter().map(|cell| cell.fg).collect() }
}

#[test]
fn every_width_shows_track_position_class_and_agents_without_cutting_a_number() {
    for (width, shown) in [
        (40, &["track", "x m", "y m", "cla"][..]),
        (80, &["track", "class", "x m", "y m", "m/s", "agents", "exist"]),
        (200, &["± m", "yaw °", "w × d m", "age s", "vehicle.car", "human.pedestrian.adult"]),
    ] {
        let drawn = drawn(&mut view(6), (width, 24), true);
        assert!(shown.iter().all(|text| drawn.has(text)), "{width}: {:#?}", drawn.lines);
        for number in 0..6 {
            let track = TrackId::new(3_000_000_000, number + 1).0.to_string();
            let row = drawn.lines.iter().find(|line| line.starts_with(&track)).unwrap();
            assert!(
                row.contains(&format!(" {:.2}", 0.0 - f64::from(number) * 3.25)) && row.contains("112.50"),
                "{row}"
            );
        }
    }
}

#[test]
fn a_track_is_written_as_json_writes_it() {
    let json = String::from_utf8(wire::json::encode_fused(&frame("hub", 1)).unwrap()).unwrap();
    let drawn = drawn(&mut view(1), (80, 24), true);
    let track =
        drawn.lines.iter().find_map(|line| line.strip_prefix("12884")).unwrap().split(' ').next().unwrap();
    assert!(json.contains(&format!("\"12884{track}\"")), "{track}: {json}");
}

#[test]
fn the_header_has_hub_objects_frame_age_and_latency() {
    for width in [40, 80, 200] {
        let drawn = drawn(&mut view(6), (width, 24), true);
        for part in [
            "hub",
            "6 objects",
            "frame 1234",
            "newest measurement 43 ms ago",
            "hub latency 0.7 ms, p95 1.4 ms",
        ] {
            assert!(drawn.has(part), "{width}: {part}: {:#?}", drawn.lines);
        }
    }
}

#[test]
fn the_reason_of_the_last_refusal_stands_beside_its_agent_or_below_it() {
    let beside = drawn(&mut view(1), (120, 24), true);
    assert!(
        beside.lines.iter().any(|line| line.starts_with("rsu") && line.contains(REFUSAL)),
        "{:#?}",
        beside.lines
    );
    let below = drawn(&mut view(1), (40, 24), true);
    let place = below.lines.iter().position(|line| line.starts_with("rsu")).unwrap();
    assert!(below.lines[place + 1].starts_with("  captured 1203.100 ms before"), "{:#?}", below.lines);
}

#[test]
fn what_has_no_room_is_counted_and_keys_scroll_to_it() {
    let mut view = view(100);
    let first = drawn(&mut view, (80, 24), true);
    let rows = |drawn: &Drawn| drawn.lines.iter().filter(|line| line.starts_with("1288490")).count();
    assert_eq!(first.lines.len(), 24);
    assert!(first.has(&format!("… and {} more", 100 - rows(&first))), "{:#?}", first.lines);
    view.act(Action::Down, now());
    assert!(drawn(&mut view, (80, 24), true).has("… 1 above"), "scrolled by one");
    view.act(Action::Last, now());
    let last = drawn(&mut view, (80, 24), true);
    assert!(
        last.has(" above, 0 below") && last.has(&TrackId::new(3_000_000_000, 100).0.to_string()),
        "{:#?}",
        last.lines
    );
    // A larger window shows all of them: the place of before does not hold.
    let whole = drawn(&mut view, (80, 120), true);
    assert!(rows(&whole) == 100 && !whole.has("above"), "{:#?}", whole.lines);
}

#[test]
fn windows_of_any_size_are_drawn() {
    let mut view = view(30);
    for size in [(1, 1), (3, 2), (10, 5), (25, 8), (40, 3), (300, 100)] {
        assert_eq!(drawn(&mut view, size, true).lines.len(), usize::from(size.1), "{size:?}");
    }
}

#[test]
fn objects_are_sorted_by_what_is_chosen() {
    let mut view = view(9);
    let first = |view: &mut View| {
        let drawn = drawn(view, (80, 24), true);
        let titles = drawn.lines.iter().position(|line| line.starts_with("track")).unwrap();
        drawn.lines[titles + 1].split(' ').next().unwrap().to_owned()
    };
    let track = |number: u32| TrackId::new(3_000_000_000, number + 1).0.to_string();
    assert_eq!(first(&mut view), track(0));
    view.act(Action::Reverse, now());
    assert_eq!(first(&mut view), track(8));
    while view.order.key != SortKey::Speed {
        view.act(Action::NextSort, now());
    }
    assert_eq!(first(&mut view), track(8), "the fastest first");
}

#[test]
fn an_agent_that_left_is_forgotten_and_one_without_a_token_is_not_while_it_sends() {
    let mut view = view(1);
    let later = |ms| now() + Span::from_millis(ms);
    // rsu gives its token back and sends nothing; ego has no token and goes on.
    for second in 1..=12 {
        let mut frame = frame("hub", 1);
        frame.agents[0].accepted += second;
        view.take_frame(frame, later(1000 * i64::try_from(second).unwrap()));
        view.take_statuses(vec![status(&[agent_status("rsu", false, 34)])], now());
    }
    let names: Vec<_> = view.hub().unwrap().roster.rows(later(12_000)).iter().map(|row| row.id).collect();
    assert!(!names.contains(&agent("rsu")) && names.contains(&agent("ego")), "{names:?}");
}

#[test]
fn an_agent_of_which_no_frame_was_accepted_is_shown_with_its_reason() {
    let mut view = view(1);
    view.take_statuses(vec![status(&[agent_status("carla", true, 3)])], now());
    let drawn = drawn(&mut view, (120, 24), true);
    assert!(
        drawn.lines.iter().any(|line| line.starts_with("carla") && line.contains(REFUSAL)),
        "{:#?}",
        drawn.lines
    );
}

#[test]
fn of_many_agents_some_are_shown_and_the_others_counted() {
    let mut view = View::new(SortKey::Track);
    let mut many = frame("hub", 20);
    many.agents = (0..60).map(|number| health(&format!("car-{number:02}"), 5, 0)).collect();
    view.take_frame(many, now());
    let drawn = drawn(&mut view, (80, 30), true);
    let rows = drawn.lines.iter().filter(|line| line.starts_with("car-")).count();
    assert!(rows > 3 && drawn.has(&format!("… and {} more agents", 60 - rows)), "{:#?}", drawn.lines);
    assert!(
        drawn.lines.iter().filter(|line| line.starts_with("1288490")).count() > 5,
        "objects keep their room"
    );
}

#[test]
fn a_second_hub_is_reached_by_a_key() {
    let mut view = view(3);
    view.take_frame(frame("north", 7), now());
    assert!(drawn(&mut view, (80, 24), true).has("3 objects"));
    view.act(Action::NextHub, now());
    let north = drawn(&mut view, (80, 24), true);
    assert!(north.has("7 objects") && north.has("hub 2 of 2"), "{:#?}", north.lines);
}

#[test]
fn a_paused_table_stands_still() {
    let mut view = view(3);
    view.act(Action::Pause, now());
    view.take_frame(frame("hub", 9), now());
    let drawn = drawn(&mut view, (80, 24), true);
    assert!(drawn.has("3 objects") && drawn.has("paused"), "{:#?}", drawn.lines);
}

#[test]
fn a_silent_hub_is_named() {
    let mut view = View::new(SortKey::Track);
    view.take_frame(frame("hub", 3), now() + Span::from_millis(-4_000));
    assert!(drawn(&mut view, (120, 24), true).has("no fused frame for 4000 ms; is the hub still there?"));
}

#[test]
fn without_colours_nothing_is_coloured() {
    let colours = drawn(&mut view(3), (80, 24), true).colours;
    assert!(colours.iter().any(|colour| *colour != Color::Reset));
    assert!(drawn(&mut view(3), (80, 24), false).colours.iter().all(|colour| *colour == Color::Reset));
}

#[test]
fn plain_lines_hold_everything_or_fit_a_width() {
    let whole = plain(&mut view(100), None, now());
    assert!(whole.contains("vehicle.car") && whole.contains(REFUSAL) && !whole.contains("more"), "{whole}");
    assert_eq!(whole.lines().filter(|line| line.starts_with("1288490")).count(), 100);
    assert!(!whole.contains('\u{1b}'));
    let narrow = plain(&mut view(100), Some(80), now());
    assert!(narrow.lines().all(|line| line.chars().count() <= 80), "{narrow}");
}

#[test]
fn keys_end_the_table_and_ctrl_c_does() {
    let key = |code, modifiers| Action::of(&Event::Key(KeyEvent::new(code, modifiers)));
    for (code, modifiers) in [
        (KeyCode::Char('q'), KeyModifiers::NONE),
        (KeyCode::Esc, KeyModifiers::NONE),
        (KeyCode::Char('c'), KeyModifiers::CONTROL),
    ] {
        assert_eq!(key(code, modifiers), Some(Action::Quit));
    }
    assert_eq!(key(KeyCode::Char('c'), KeyModifiers::NONE), None);
    assert_eq!(Action::of(&Event::Resize(40, 20)), Some(Action::Redraw));
}

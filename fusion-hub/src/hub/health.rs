//! Whether all is well: findings about the agents and the hub itself, each of them logged once when it begins and once when it ends.

use super::core::Core;
use super::crowding::Crowding;
use super::denials::Denials;
use super::recorder::RecordingStatus;
use super::roster::Roster;
use super::unnamed::InvalidName;
use crate::diagnosis::{Code, Finding};
use crate::engine::AgentRecord;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::net::zenoh_breakers;
use v2x_common::net::zenoh_peers::Sessions;
use v2x_common::net::zenoh_refusals::ZenohRefusals;
use v2x_common::spelling::nearest;
use v2x_common::time::{Span, Timestamp};

/// After a start nobody is missed for so long.
const PATIENCE: Span = Span::from_millis(5_000);
/// A hub that has begun again says so for this long.
const BEGAN_AGAIN_FOR: Span = Span::from_millis(600_000);
/// Dropped frames, and samples that are not recorded, are reported for so long.
const LATELY: Span = Span::from_millis(10_000);

/// All in all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// At least one agent is alive, and nothing that is found makes the list worse.
    #[default]
    Healthy,
    /// Something does; the findings say what.
    Degraded,
}

impl Verdict {
    /// Of some findings.
    pub fn of(findings: &[Finding]) -> Self {
        if findings.iter().any(Finding::is_fault) { Self::Degraded } else { Self::Healthy }
    }
}

/// What was found at the last check.
#[derive(Debug, Default)]
pub(super) struct Health {
    /// How often this process has begun again because Zenoh's code was broken.
    began_again: u32,
    findings: Vec<Finding>,
    dropped: u64,
    dropped_at: Option<Timestamp>,
    unrecorded: u64,
    unrecorded_at: Option<Timestamp>,
    denials: Denials,
    crowding: Crowding,
}

/// What the hub itself has seen, beside its core.
pub(super) struct Seen<'a> {
    pub(super) roster: &'a Roster,
    pub(super) started_at: Timestamp,
    /// Samples dropped from full queues so far.
    pub(super) dropped: u64,
    pub(super) invalid_names: Vec<InvalidName>,
    /// What is published beside the keys that are read.
    pub(super) strays: Vec<Finding>,
    /// The lineage of another hub of this name.
    pub(super) twin: Option<u32>,
    /// The lineage of one of its two hubs whose lists are made by other settings.
    pub(super) standby_differs: Option<u32>,
    /// Whether the Zenoh configuration in its file is not the one in force.
    pub(super) is_access_behind: bool,
    /// By Zenoh, since the start.
    pub(super) refused_by_zenoh: ZenohRefusals,
    /// Who is connected.
    pub(super) sessions: Sessions,
    /// The hub's own recording, where it writes one.
    pub(super) recording: Option<RecordingStatus>,
}

/// Whose a finding is; of the network there may be several of one kind, which differ by more than their numbers.
fn of_whom(finding: &Finding) -> String {
    let is_word = |c: &char| !(c.is_ascii_digit() || matches!(c, '+' | '-' | '.'));
    finding.agent.map_or_else(|| finding.says.chars().filter(is_word).collect(), |agent| agent.to_string())
}

impl Health {
    /// Of a hub whose process has begun again so often because Zenoh's code was broken.
    pub(super) fn of(began_again: u32) -> Self {
        Self { began_again, ..Self::default() }
    }

    /// Checks the agents and the hub; warns of each fault when it begins, and says when it has ended.
    pub(super) fn check(&mut self, core: &mut Core, seen: &Seen<'_>, now: Timestamp) {
        core.diagnose(seen.roster.tokens(), now);
        let mut findings = core.findings().to_vec();
        findings.extend(self.of_hub(core, seen, now));
        // The worst first, whoever found it.
        findings.sort_by_key(|one| one.severity);
        fn faults(findings: &[Finding]) -> BTreeMap<(Code, String), &Finding> {
            let faults = findings.iter().filter(|one| one.is_fault());
            faults.map(|one| ((one.code, of_whom(one)), one)).collect()
        }
        let (before, after) = (faults(&self.findings), faults(&findings));
        for (key, one) in after.iter().filter(|(key, _)| !before.contains_key(key)) {
            tracing::warn!(finding = key.0.name(), "{one}");
        }
        for (key, one) in before.iter().filter(|(key, _)| !after.contains_key(key)) {
            tracing::info!(finding = key.0.name(), "no longer found: {}", one.in_short());
        }
        self.findings = findings;
    }

    /// What is found of the network and of the hub.
    fn of_hub(&mut self, core: &Core, seen: &Seen<'_>, now: Timestamp) -> Vec<Finding> {
        let mut findings = Vec::new();
        if seen.dropped > self.dropped {
            self.dropped_at = Some(now);
        }
        // Of frames it is said whose they were.
        let is_said = core.findings().iter().any(|one| one.code == Code::Overload);
        if !is_said && self.dropped_at.is_some_and(|at| now - at < LATELY) {
            let says = format!("this hub has dropped {} samples for lack of time", seen.dropped);
            let change =
                "Fewer agents, lower rates, or a faster machine; `agents[].refused.queue_full` says whose";
            findings.push(Finding::of_network(Code::Overload, says, change));
        }
        self.dropped = seen.dropped;
        findings.extend(began_again(self.began_again, seen, now));
        findings.extend(seen.recording.as_ref().and_then(|recording| self.of_recording(recording, now)));
        findings.extend(self.denials.findings(seen.refused_by_zenoh.clone(), now));
        findings.extend(self.crowding.finding(&seen.sessions, now));
        if seen.is_access_behind {
            let says = "the Zenoh configuration was written anew and is not followed: who was revoked in it is still let in";
            let change = "The hub's log says why; it tries again by itself";
            findings.push(Finding::of_network(Code::RefusedByZenoh, says, change));
        }
        for InvalidName { name, reason, .. } in &seen.invalid_names {
            let says = format!("nothing of agent {name:?} is used: {reason}");
            findings.push(Finding::of_network(Code::InvalidName, says, "Give it another name"));
        }
        findings.extend(seen.strays.iter().cloned());
        if let Some(lineage) = seen.twin {
            let says = format!(
                "another hub (lineage {lineage}) publishes under this hub's name: consumers get both lists in turn"
            );
            let change = "Give one of them another name (`v2x hub --id`), or end it; if nobody else should run one, somebody \
                          claims its name: `v2x certs`";
            findings.push(Finding::of_network(Code::TwoHubs, says, change));
        }
        if let Some(lineage) = seen.standby_differs {
            let says = format!(
                "the hub that publishes (lineage {lineage:08x}) and this one, which stands by, have other settings"
            );
            let change =
                "Give both the same version and the same settings: lists change when this hub takes over";
            findings.push(Finding::of_network(Code::StandbyDiffers, says, change));
        }
        findings.extend(missing(core, seen, now));
        // Who is heard of by a wrong name or key is why nobody else is.
        let is_explained = findings
            .iter()
            .any(|one| matches!(one.code, Code::InvalidName | Code::WrongKey | Code::WrongNetwork));
        if !is_explained {
            findings.extend(nobody(core, seen, now));
        }
        findings
    }

    /// What is found of the hub's own recording: that it has ended, else that it has gaps.
    fn of_recording(&mut self, recording: &RecordingStatus, now: Timestamp) -> Option<Finding> {
        if recording.dropped > self.unrecorded {
            self.unrecorded_at = Some(now);
        }
        self.unrecorded = recording.dropped;
        if let Some(error) = &recording.error {
            let says = format!("nothing is recorded any more: {error}");
            let change = "Make room on the disk, and start the hub again; fusion goes on meanwhile";
            return Some(Finding::of_network(Code::Recording, says, change));
        }
        self.unrecorded_at.filter(|at| now - *at < LATELY).map(|_| {
            let says =
                format!("the hub's recording lacks {} samples: the disk is too slow", recording.dropped);
            Finding::of_network(
                Code::Recording,
                says,
                "Record to a faster disk, or by `v2x record` elsewhere",
            )
        })
    }

    /// Everything that was found at the last check.
    pub(super) fn findings(&self) -> &[Finding] {
        &self.findings
    }
}

/// No agent is there: those that were have ended, or none ever was.
fn nobody(core: &Core, seen: &Seen<'_>, now: Timestamp) -> Option<Finding> {
    /// Agents that are named.
    const MOST_NAMED: usize = 4;
    let engine = core.engine();
    let is_anybody_alive = engine.agents().iter().any(|(agent, _)| seen.roster.is_alive(agent, engine));
    if is_anybody_alive || !seen.roster.tokens().alive.is_empty() || now - seen.started_at < PATIENCE {
        return None;
    }
    let ended = engine.agents().iter().filter_map(|(agent, record)| {
        let accepted = record.statistics.accepted;
        Some((record.last_heard_at()?, agent, accepted)).filter(|_| accepted > 0)
    });
    let mut ended: Vec<_> = ended.collect();
    if ended.is_empty() {
        let says = "no agent sends anything to this hub";
        let change =
            "Do agents use its network's name and its endpoint? `v2x check` listens beside the expected keys";
        return Some(Finding::of_network(Code::NoAgents, says, change));
    }
    ended.sort_by_key(|(at, agent, _)| (std::cmp::Reverse(*at), *agent));
    let named = ended.iter().take(MOST_NAMED).map(|(at, agent, accepted)| {
        let ago_s = (now - *at).as_secs_f64();
        format!("{agent} sent {accepted} frames until {ago_s:.0} s ago, and has ended")
    });
    let more = if ended.len() > MOST_NAMED { "; …" } else { "" };
    let says = format!("no agent is left: {}{more}", named.collect::<Vec<_>>().join("; "));
    let change = "Start the agents' programs again, if they are not meant to have ended";
    Some(Finding::of_network(Code::NoAgents, says, change))
}

/// A hub that has begun again lately, by itself.
fn began_again(times: u32, seen: &Seen<'_>, now: Timestamp) -> Option<Finding> {
    let is_lately = now - seen.started_at < BEGAN_AGAIN_FOR;
    (times > 0 && is_lately).then(|| {
        let by = zenoh_breakers::breakers_in_words();
        let by = by.unwrap_or_else(|| "what somebody sends".to_owned());
        let says = format!(
            "this hub has begun again by itself, {times} times since it was started: Zenoh's code was broken by {by}"
        );
        let change = "No client of Zenoh sends such messages: keep that address out by a firewall, and revoke the certificate; \
                      revoking alone does not help against this";
        Finding::of_network(Code::BeganAgain, says, change)
    })
}

/// Agents that the settings name, and that are not there.
fn missing(core: &Core, seen: &Seen<'_>, now: Timestamp) -> Vec<Finding> {
    let (engine, settings) = (core.engine(), core.settings());
    if now - seen.started_at < PATIENCE {
        return Vec::new();
    }
    let senders = engine.agents().iter().map(|(agent, _)| agent).chain(&seen.roster.tokens().alive);
    let left_out: Vec<_> = senders
        .filter(|agent| !settings.listens_to(agent) && seen.roster.is_alive(agent, engine))
        .map(AgentId::as_str)
        .collect();
    let missing = settings.only_agents.iter().filter(|agent| !seen.roster.is_alive(agent, engine));
    let finding = |agent: &AgentId| {
        let heard_at = engine.agents().record(agent).and_then(AgentRecord::last_heard_at);
        let says = match heard_at {
            Some(at) => format!(
                "`only_agents` names it, and it is gone: nothing of it has arrived for {:.0} s",
                (now - at).as_secs_f64()
            ),
            None => {
                "`only_agents` names it, and it is not there: nothing of it has arrived since this hub was started"
                    .to_owned()
            }
        };
        let change = match nearest(agent.as_str(), left_out.iter().copied()) {
            Some(other) => format!("{other} is there, and left out: if it is that one, write {other} in `only_agents`"),
            None => "Start it with this name, for this network, connected to this hub; if it is to take part no longer, take it out \
                     of `only_agents` in the hub's configuration"
                .to_owned(),
        };
        Finding { agent: Some(*agent), ..Finding::of_network(Code::Missing, says, change) }
    };
    missing.map(finding).chain(unheard_tables(core, seen)).collect()
}

/// Agents of which the settings have a table, and of which nothing was ever heard: those who may come later, and names misspelt.
fn unheard_tables(core: &Core, seen: &Seen<'_>) -> Vec<Finding> {
    let (engine, settings) = (core.engine(), core.settings());
    let is_heard = |agent: &AgentId| {
        engine.agents().record(agent).is_some_and(|record| record.last_heard_at().is_some())
            || seen.roster.is_alive(agent, engine)
    };
    let senders = engine.agents().iter().map(|(agent, _)| agent).chain(&seen.roster.tokens().alive);
    let without: Vec<_> = senders.filter(|agent| !settings.agents.contains_key(agent)).collect();
    let unheard =
        settings.agents.keys().filter(|agent| !settings.only_agents.contains(agent) && !is_heard(agent));
    let finding = |agent: &AgentId| {
        let says = format!(
            "`[hub.agents.{agent}]` is there, and nothing of such an agent has arrived since this hub was started"
        );
        let alike = without.iter().find(|other| other.as_str().eq_ignore_ascii_case(agent.as_str()));
        let nearest = || nearest(agent.as_str(), without.iter().map(|other| other.as_str()));
        let (is_sure, change) = match alike.map(|other| other.as_str()).or_else(nearest) {
            Some(other) => (
                alike.is_some(),
                format!(
                    "{other} is there, and has no table: if it is that one, write `[hub.agents.{other}]`"
                ),
            ),
            None => (false, "Where it comes later, nothing is wrong; names are case-sensitive".to_owned()),
        };
        let found = Finding { agent: Some(*agent), ..Finding::of_network(Code::Missing, says, change) };
        if is_sure { found } else { found.as_note() }
    };
    unheard.map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Engine;
    use crate::hub::settings::HubSettings;
    use crate::hub::token_changes::Token;
    use v2x_common::wire::journal::Body;

    fn at(seconds: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1000 * seconds)
    }

    fn agent(name: &str) -> AgentId {
        AgentId::new(name).unwrap()
    }

    fn seen(roster: &Roster) -> Seen<'_> {
        Seen {
            roster,
            started_at: at(0),
            dropped: 0,
            invalid_names: Vec::new(),
            strays: Vec::new(),
            twin: None,
            standby_differs: None,
            is_access_behind: false,
            refused_by_zenoh: ZenohRefusals::default(),
            sessions: Sessions::default(),
            recording: None,
        }
    }

    #[test]
    fn that_no_agent_sends_says_who_has_ended_and_is_not_told_beside_its_cause_or_of_who_is_there() {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let roster = Roster::default();
        let found = |core: &mut Core, seconds: i64, invalid_names: Vec<InvalidName>| {
            let mut health = Health::default();
            core.fused(at(seconds));
            health.check(core, &Seen { invalid_names, ..seen(&roster) }, at(seconds));
            let found = health.findings().iter().filter(|one| one.code == Code::NoAgents);
            found.map(|one| one.says.clone()).collect::<Vec<_>>()
        };
        let invalid = || {
            let (name, reason) = ("my+cam".to_owned(), "it holds '+'".to_owned());
            vec![InvalidName { name, reason, samples: 9 }]
        };
        assert_eq!(found(&mut core, 4, vec![]), [""; 0], "they may still come");
        assert_eq!(found(&mut core, 6, vec![]), ["no agent sends anything to this hub"]);
        assert_eq!(found(&mut core, 6, invalid()), [""; 0], "that is why");
        for second in 7..10 {
            let json = format!(r#"{{"captured_at":{second}000000,"detections":[]}}"#);
            core.handle_frame(agent("cam"), at(second), &Body::Json(json.as_bytes()));
        }
        assert_eq!(found(&mut core, 10, vec![]), [""; 0], "it is there");
        let ended = "no agent is left: cam sent 3 frames until 25 s ago, and has ended";
        assert_eq!(found(&mut core, 34, vec![]), [ended]);
    }

    #[test]
    fn a_name_that_is_not_allowed_is_told_and_only_that() {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let roster = Roster::default();
        let mut codes = |invalid_names: Vec<InvalidName>| {
            let mut health = Health::default();
            health.check(&mut core, &Seen { invalid_names, ..seen(&roster) }, at(1));
            health.findings().iter().map(|one| one.code).collect::<Vec<_>>()
        };
        let (name, reason) = ("my+cam".to_owned(), "it holds '+'".to_owned());
        assert_eq!(codes(vec![InvalidName { name, reason, samples: 9 }]), [Code::InvalidName]);
        assert_eq!(codes(vec![]), []);
    }

    #[test]
    fn another_hub_of_this_name_and_one_with_other_settings_are_told_and_none_are_not() {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let roster = Roster::default();
        let mut codes = |twin: Option<u32>, standby_differs: Option<u32>| {
            let mut health = Health::default();
            health.check(&mut core, &Seen { twin, standby_differs, ..seen(&roster) }, at(1));
            health.findings().iter().map(|one| one.code).collect::<Vec<_>>()
        };
        assert_eq!(codes(None, None), []);
        assert_eq!(codes(Some(7), None), [Code::TwoHubs]);
        assert_eq!(codes(None, Some(7)), [Code::StandbyDiffers]);
    }

    #[test]
    fn samples_that_are_dropped_are_overload_for_a_while_and_none_are_not() {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let roster = Roster::default();
        let mut health = Health::default();
        let mut is_told = |dropped: u64, seconds: i64| {
            health.check(&mut core, &Seen { dropped, ..seen(&roster) }, at(seconds));
            health.findings().iter().any(|one| one.code == Code::Overload)
        };
        assert!(!is_told(0, 1) && is_told(7, 2) && is_told(7, 11) && !is_told(7, 12));
    }

    #[test]
    fn a_restart_by_itself_is_told_for_a_while() {
        let mut core = Core::new(HubSettings::default(), Engine::new);
        let roster = Roster::default();
        let mut is_told = |began_again: u32, seconds: i64| {
            let mut health = Health::of(began_again);
            core.fused(at(seconds));
            health.check(&mut core, &seen(&roster), at(seconds));
            health.findings().iter().any(|one| one.code == Code::BeganAgain)
        };
        assert!(!is_told(0, 5) && is_told(2, 6) && !is_told(2, 700));
    }

    #[test]
    fn a_table_of_settings_whose_agent_has_another_name_is_told() {
        let settings =
            "[agents.Cam2]\ntime_offset_ms = 5\n[agents.later]\ntime_offset_ms = 5".parse().unwrap();
        let mut core = Core::new(HubSettings::from_table(settings).unwrap(), Engine::new);
        let (mut health, roster) = (Health::default(), Roster::default());
        let json = r#"{"captured_at":1000000,"detections":[]}"#;
        core.handle_frame(agent("cam2"), at(1), &Body::Json(json.as_bytes()));
        core.fused(at(6));
        health.check(&mut core, &seen(&roster), at(6));
        let found: Vec<_> = health.findings().iter().filter(|one| one.code == Code::Missing).collect();
        let of = |name: &str| *found.iter().find(|one| one.agent == Some(agent(name))).unwrap();
        assert!(
            of("Cam2").is_fault() && of("Cam2").change.contains("write `[hub.agents.cam2]`"),
            "{found:?}"
        );
        assert!(!of("later").is_fault(), "it may come later");
    }

    #[test]
    fn an_agent_that_the_settings_name_and_that_is_gone_makes_a_hub_degraded_by_its_name() {
        let settings = "only_agents = [\"ego\", \"rsu-north\", \"cam\"]".parse().unwrap();
        let mut core = Core::new(HubSettings::from_table(settings).unwrap(), Engine::new);
        let (mut health, mut roster) = (Health::default(), Roster::default());
        roster.note(&Token::alive(agent("cam")), true);
        roster.note(&Token::alive(agent("rsu_north")), true);
        let json = r#"{"captured_at":1000000,"detections":[]}"#;
        core.handle_frame(agent("ego"), at(1), &Body::Json(json.as_bytes()));
        let mut missing = |core: &mut Core, roster: &Roster, seconds: i64| {
            core.fused(at(seconds));
            health.check(core, &seen(roster), at(seconds));
            let found = health.findings().iter().filter(|one| one.code == Code::Missing);
            (found.map(ToString::to_string).collect::<Vec<_>>(), Verdict::of(health.findings()))
        };
        assert_eq!(missing(&mut core, &roster, 4), (vec![], Verdict::Healthy), "they may still come");
        let (found, verdict) = missing(&mut core, &roster, 6);
        let [rsu] = &found[..] else { panic!("{found:?}") };
        assert!(rsu.starts_with("rsu-north: ") && rsu.contains("write rsu_north in"), "{rsu}");
        assert_eq!(verdict, Verdict::Degraded);
        roster.note(&Token::alive(agent("rsu-north")), true);
        let (found, _) = missing(&mut core, &roster, 20);
        let [ego] = &found[..] else { panic!("{found:?}") };
        assert!(health.findings().is_sorted_by_key(|one| one.severity));
        assert!(
            ego.starts_with("ego: ") && ego.contains("arrived for 19 s") && ego.contains("Start it"),
            "{ego}"
        );
    }

    #[test]
    fn a_fault_of_the_recording_is_found_while_it_has_gaps_and_for_good_when_it_has_ended() {
        let mut health = Health::default();
        let mut found = |dropped, error: Option<&str>, seconds| {
            let recording = RecordingStatus { bytes: 0, dropped, error: error.map(str::to_owned) };
            health.of_recording(&recording, at(seconds)).map(|one| one.says)
        };
        assert_eq!(found(0, None, 0), None);
        assert!(found(7, None, 1).is_some_and(|says| says.contains("lacks 7 samples")));
        assert!(found(7, None, 10).is_some());
        assert_eq!(found(7, None, 11), None);
        assert!(found(7, Some("No space left"), 100).is_some_and(|says| says.contains("No space left")));
    }
}

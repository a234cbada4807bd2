//! What Zenoh has refused lately, as findings.

use crate::diagnosis::{Code, Finding, Severity};
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::net::zenoh_refusals::{Denied, ZenohRefusals};
use v2x_common::time::{Span, Timestamp};

/// What was refused within this, and up to twice as long ago, is reported.
const LATELY: Span = Span::from_millis(10_000);

/// What Zenoh had refused some time ago.
#[derive(Debug, Default)]
pub(super) struct Denials {
    before: ZenohRefusals,
    last: ZenohRefusals,
    last_at: Option<Timestamp>,
}

impl Denials {
    /// What is to be said of what was refused since; `now_refused` is counted from the start.
    pub(super) fn findings(&mut self, now_refused: ZenohRefusals, now: Timestamp) -> Vec<Finding> {
        let mut by_name = BTreeMap::<&str, (u64, &Denied)>::new();
        for kind in &now_refused.denied {
            let same = |other: &&Denied| {
                (&other.who, &other.action, &other.key) == (&kind.who, &kind.action, &kind.key)
            };
            let before = self.before.denied.iter().find(same).map_or(0, |kind| kind.count);
            let count = kind.count.saturating_sub(before);
            if count > 0 {
                let of_name = by_name.entry(&kind.who).or_insert((0, kind));
                of_name.0 += count;
                // What would have been fused is worth more than what would have been read.
                if !publishes(of_name.1) && publishes(kind) {
                    of_name.1 = kind;
                }
            }
        }
        let mut findings: Vec<_> =
            by_name.iter().map(|(who, (count, kind))| denied(who, *count, kind)).collect();
        let shaken = now_refused.handshakes_total().saturating_sub(self.before.handshakes_total());
        findings.extend((shaken > 0).then(|| handshakes(shaken, &now_refused)));
        if self.last_at.is_none_or(|at| now - at >= LATELY) {
            self.before = std::mem::replace(&mut self.last, now_refused);
            self.last_at = Some(now);
        }
        findings
    }
}

/// Whether it is a frame, or a description of a sensor.
fn publishes(kind: &Denied) -> bool {
    kind.action == "Put" && kind.key.contains("/agent/")
}

fn denied(who: &str, count: u64, kind: &Denied) -> Finding {
    let Denied { action, key, .. } = kind;
    // A certificate that was issued again has its generation behind the name.
    let name = who.strip_prefix("agent:").map(|name| name.split_once('/').map_or(name, |(name, _)| name));
    let agent = name.and_then(|name| AgentId::new(name).ok());
    let says =
        format!("the access control denied {count} messages of {who} lately, such as {action} on `{key}`");
    let own = agent.map(|agent| format!("/agent/{agent}/"));
    let change = match &own {
        Some(own) if !key.contains(own) => {
            "Its certificate is for another name than the one under which it publishes: give it `--id` of the \
             certificate, or a certificate of that name by `v2x certs agent NAME`; if neither is meant, it claims to be \
             another agent: `v2x certs revoke`"
        }
        Some(_) => {
            "Its certificate was revoked or replaced, and it still runs; or the hub's configuration was written before the \
             agent's: `v2x certs list` shows both"
        }
        None => "A role with that right is given by `v2x certs agent NAME` or `v2x certs viewer NAME`",
    };
    // What nobody has let in may try what it likes: that is no fault of the network.
    let is_own = own.as_ref().is_some_and(|own| key.contains(own));
    let is_fault = agent.is_some() && publishes(kind) && !is_own;
    let severity = if is_fault { Severity::Fault } else { Severity::Note };
    Finding { code: Code::RefusedByZenoh, severity, agent, says, change: change.to_owned() }
}

fn handshakes(count: u64, refusals: &ZenohRefusals) -> Finding {
    let causes: Vec<_> =
        refusals.handshakes.iter().map(|(cause, count)| format!("{cause} {count}")).collect();
    Finding {
        code: Code::RefusedByZenoh,
        severity: Severity::Note,
        agent: None,
        says: format!("{count} TLS handshakes were refused lately (since the start: {})", causes.join(", ")),
        change: "Who should be let in needs a certificate of this network's authority that is valid now: `v2x certs list`"
            .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(who: &str, action: &str, key: &str, count: u64) -> ZenohRefusals {
        let kind = Denied { who: who.to_owned(), action: action.to_owned(), key: key.to_owned(), count };
        ZenohRefusals { messages: count, denied: vec![kind], ..ZenohRefusals::default() }
    }

    fn at(seconds: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1000 * seconds)
    }

    #[test]
    fn frames_under_a_name_that_is_not_the_certificates_are_a_fault_as_long_as_they_come() {
        let mut denials = Denials::default();
        let eve = |count| refused("agent:eve", "Put", "v2x/demo/agent/ego/detections", count);
        let found = denials.findings(eve(3), at(0));
        let [one] = &found[..] else { panic!("{found:?}") };
        assert!(one.is_fault() && one.agent.is_some_and(|agent| agent.as_str() == "eve"), "{one}");
        assert!(one.says.contains("denied 3 messages") && one.change.contains("another name"), "{one}");
        assert_eq!(denials.findings(eve(3), at(5)).len(), 1);
        denials.findings(eve(3), at(11));
        assert_eq!(denials.findings(eve(3), at(12)), [], "nothing more came");
        assert!(denials.findings(eve(4), at(13))[0].says.contains("denied 1 messages"));
    }

    #[test]
    fn what_the_acl_denies_to_strangers_and_what_is_only_read_is_a_note() {
        for (who, action, key) in [
            ("eve", "Put", "v2x/demo/agent/ego/detections"),
            ("agent:eve", "Declare Subscriber", "v2x/demo/agent/*/detections"),
        ] {
            let found = Denials::default().findings(refused(who, action, key, 1), at(0));
            assert!(found.len() == 1 && !found[0].is_fault(), "{found:?}");
        }
        let mut shaken = ZenohRefusals::default();
        shaken.handshakes.insert("expired".to_owned(), 2);
        let found = Denials::default().findings(shaken, at(0));
        assert!(found.len() == 1 && found[0].says.contains("expired 2") && !found[0].is_fault(), "{found:?}");
        assert_eq!(Denials::default().findings(ZenohRefusals::default(), at(0)), []);
    }
}

//! A network that no hub serves: nobody fuses its frames, however sound they are.

use crate::served::Served;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::time::Span;
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// What was asked for.
pub(super) struct Asked {
    pub(super) network: NetworkId,
    pub(super) hub: Option<HubId>,
    /// This command stands in for a hub: then nobody misses one.
    pub(super) stands_in: bool,
    /// Whether a hub that was heard is still there, by its token.
    pub(super) is_alive: bool,
    /// For how long it was asked.
    pub(super) waited: Span,
}

/// Where no hub has answered: that nobody fuses the frames that were heard, and which network has a hub. `None` where there is
/// nothing at all.
pub(super) fn finding(asked: &Asked, served: &Served, frames: u64) -> Option<Finding> {
    let Asked { network, hub, stands_in, is_alive, waited } = asked;
    let networks = served.networks();
    if *stands_in || (networks.is_empty() && frames == 0) {
        return None;
    }
    let heard = match frames {
        0 => "no frame was heard in it either".to_owned(),
        1 => "nobody fuses the frame that was heard".to_owned(),
        _ => format!("nobody fuses the {frames} frames that were heard"),
    };
    if networks.contains(network) {
        let there = served.names(*network);
        return Some(if served.has(*network, *hub) && !is_alive {
            let says = format!(
                "network {network} had {there} when this program began to listen, and has none now: {heard}"
            );
            Finding::of_network(Code::NoHub, says, "Start it again; its log says why it ended")
        } else if served.has(*network, *hub) {
            let says = format!(
                "network {network} has {there}, which does not answer within {:.0} s: it is overloaded, or this program may not ask it",
                waited.as_secs_f64()
            );
            let change = "Ask again, look at its processor and its log, send it less; who may ask is in `v2x certs`. What is said here \
                          of agents is found by this program";
            Finding::of_network(Code::Overload, says, change)
        } else {
            let hub = hub.map(|hub| hub.to_string()).unwrap_or_default();
            let says = format!("network {network} has {there}, and none with the name {hub}");
            Finding::of_network(Code::NoHub, says, "Is the name of `--hub` right?")
        });
    }
    let others: Vec<_> = networks.iter().map(NetworkId::to_string).collect();
    let (says, change) = match &others[..] {
        [] => (
            format!("no hub serves network {network}: {heard}"),
            format!("Start one: `v2x hub --network {network}`"),
        ),
        [other] => (
            format!("no hub serves network {network}: {heard}. The hub here serves network {other}"),
            format!(
                "Use `--network {other}` here and for the agents, or start the hub with `--network {network}`"
            ),
        ),
        others => (
            format!("no hub serves network {network}: {heard}. The hubs here serve {}", others.join(", ")),
            format!(
                "Use `--network` with one of these here and for the agents, or start a hub with `--network {network}`"
            ),
        ),
    };
    Some(Finding::of_network(Code::NoHub, says, change))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(name: &str) -> NetworkId {
        NetworkId::new(name).unwrap()
    }

    fn hubs(networks: &[&str]) -> Served {
        let mut served = Served::default();
        networks.iter().for_each(|network| served.note(&format!("v2x/{network}/hub/north/alive")));
        served
    }

    fn found(stands_in: bool, served: &[&str], frames: u64) -> Option<String> {
        let waited = Span::from_millis(11_000);
        let asked = Asked { network: network("demo"), hub: None, stands_in, is_alive: true, waited };
        finding(&asked, &hubs(served), frames).map(|one| one.to_string())
    }

    #[test]
    fn frames_that_nobody_fuses_are_a_fault_that_names_the_network_to_use() {
        let words = found(false, &["north"], 100).unwrap();
        assert!(
            words.contains("nobody fuses the 100 frames") && words.contains("`--network north`"),
            "{words}"
        );
        assert!(found(false, &["north", "south"], 0).unwrap().contains("serve north, south"));
        assert!(found(false, &[], 100).unwrap().contains("v2x hub --network demo"));
        // A hub that is there and has no time is not called absent.
        let busy = found(false, &["demo"], 100).unwrap();
        assert!(busy.contains("hub north, which does not answer within 11 s: it is overloaded"), "{busy}");
        let (hub, waited) = (HubId::new("south").ok(), Span::ZERO);
        let asked = Asked { network: network("demo"), hub, stands_in: false, is_alive: true, waited };
        let other = finding(&asked, &hubs(&["demo"]), 0).unwrap();
        assert!(other.code == Code::NoHub && other.says.contains("none with the name south"), "{other}");
    }

    #[test]
    fn a_hub_that_ended_while_it_was_listened_to_is_gone_and_not_overloaded() {
        let asked = Asked {
            network: network("demo"),
            hub: None,
            stands_in: false,
            is_alive: false,
            waited: Span::from_millis(11_000),
        };
        let gone = finding(&asked, &hubs(&["demo"]), 50).unwrap();
        assert!(gone.code == Code::NoHub && gone.says.contains("had hub north"), "{gone}");
        assert!(gone.change.starts_with("Start it again"), "{gone}");
    }

    #[test]
    fn who_stands_in_for_a_hub_misses_none_and_nothing_at_all_is_no_finding() {
        assert_eq!(found(true, &["north"], 100), None);
        assert_eq!(found(false, &[], 0), None);
    }
}

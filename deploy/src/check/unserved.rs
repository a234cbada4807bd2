//! A network that no hub serves: nobody fuses its frames, however sound they are.

use std::collections::BTreeSet;
use v2x_common::id::{HubId, NetworkId};
use v2x_fusion_hub::diagnosis::{Code, Finding};

/// What was asked for.
pub(super) struct Asked {
    pub(super) network: NetworkId,
    pub(super) hub: Option<HubId>,
    /// This command stands in for a hub: then nobody misses one.
    pub(super) stands_in: bool,
}

/// Where no hub has answered: that nobody fuses the frames that were heard, and which network has a hub. `None` where there is
/// nothing at all.
pub(super) fn finding(asked: &Asked, served: &BTreeSet<NetworkId>, frames: u64) -> Option<Finding> {
    let Asked { network, hub, stands_in } = asked;
    if *stands_in || (served.is_empty() && frames == 0) {
        return None;
    }
    let heard = match frames {
        0 => "no frame was heard in it either".to_owned(),
        1 => "nobody fuses the frame that was heard".to_owned(),
        _ => format!("nobody fuses the {frames} frames that were heard"),
    };
    if served.contains(network) {
        let who = hub.map_or_else(|| "its hub".to_owned(), |hub| format!("hub {hub}"));
        let says = format!("network {network} is served, and {who} does not answer");
        let change = "Is the name of `--hub` right, and may this program ask it (`v2x certs`)?";
        return Some(Finding::of_network(Code::NoHub, says, change));
    }
    let others: Vec<_> = served.iter().map(NetworkId::to_string).collect();
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

    fn found(stands_in: bool, served: &[&str], frames: u64) -> Option<String> {
        let asked = Asked { network: network("demo"), hub: None, stands_in };
        finding(&asked, &served.iter().map(|name| network(name)).collect(), frames).map(|one| one.to_string())
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
        assert!(found(false, &["demo"], 100).unwrap().contains("does not answer"));
    }

    #[test]
    fn who_stands_in_for_a_hub_misses_none_and_nothing_at_all_is_no_finding() {
        assert_eq!(found(true, &["north"], 100), None);
        assert_eq!(found(false, &[], 0), None);
    }
}

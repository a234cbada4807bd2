//! The access control of a hub: everything is denied, except what a role needs.
//!
//! Zenoh compares common names as a whole, so that there is a rule for each agent. The hub's own puts do not pass the access
//! control: nobody else can put a list, a status or a journal, but the hub that stands by for it, which has its certificate.

use super::register::{Holder, HubEntry, Register, Role, hub_common_name};
use serde_json::{Value, json};

/// The access control of Zenoh's configuration of a hub, for a register.
pub(super) fn access_control(hub: &HubEntry, register: &Register) -> Value {
    let agents: Vec<_> = register.admitted(Role::Agent).collect();
    let viewers: Vec<_> = register.admitted(Role::Viewer).map(Holder::common_name).collect();
    let mut rules = vec![nothing()];
    rules.extend(relaying());
    let same = hub_common_name(hub.name);
    let mut subjects =
        vec![json!({ "id": "anybody" }), json!({ "id": "same hub", "cert_common_names": [same] })];
    // The first one allows nothing; by it Zenoh's log names those that no other rule knows, too.
    let mut policies = vec![
        json!({ "rules": ["nothing"], "subjects": ["anybody"] }),
        json!({ "rules": ["hub-gives", "hub-gets"], "subjects": ["same hub"] }),
    ];
    if !agents.is_empty() {
        rules.extend(reading_of_agents());
        let names: Vec<_> = agents.iter().map(|agent| agent.common_name()).collect();
        let rules = ["lists-asked", "lists-given", "listeners-given"];
        policies.push(json!({ "rules": rules, "subjects": names }));
    }
    for agent in agents {
        let name = agent.common_name();
        rules.extend(publishing(agent, &name));
        subjects.push(json!({ "id": name, "cert_common_names": [name] }));
        policies.push(
            json!({ "rules": [format!("{name} puts"), format!("{name} is alive")], "subjects": [name] }),
        );
    }
    if !viewers.is_empty() {
        rules.extend(reading_of_viewers());
        subjects.push(json!({ "id": "viewers", "cert_common_names": viewers }));
        policies.push(json!({ "rules": ["all-asked", "all-given"], "subjects": ["viewers"] }));
    }
    denying_else(&rules, &subjects, &policies)
}

/// The access control of a client: nothing is said to, or taken from, anybody but a hub of this authority, by the name in its
/// certificate; and no hub speaks for another one of them.
///
/// A hub may pass on the lists of hubs that have no certificate of their own here: a router does.
pub(super) fn believing(hubs: &[HubEntry]) -> Value {
    let names: Vec<_> = hubs.iter().map(|hub| hub_common_name(hub.name)).collect();
    let own = |hub: &HubEntry| format!("{} says", hub_common_name(hub.name));
    let mut rules = vec![json!({
        "id": "all", "permission": "allow", "flows": ["ingress", "egress"], "messages": EVERYTHING, "key_exprs": ["**"],
    })];
    let mut policies = vec![json!({ "rules": ["all"], "subjects": names })];
    for hub in hubs.iter().filter(|_| hubs.len() > 1) {
        rules.push(json!({
            "id": own(hub), "permission": "deny", "flows": ["ingress"], "messages": SAYING,
            "key_exprs": [format!("v2x/*/hub/{}/**", hub.name), format!("v2x/*/hub/{}~$*/**", hub.name)],
        }));
        let others: Vec<_> = hubs
            .iter()
            .filter(|other| other.name != hub.name)
            .map(|other| hub_common_name(other.name))
            .collect();
        policies.push(json!({ "rules": [own(hub)], "subjects": others }));
    }
    let subjects: Vec<_> =
        names.iter().map(|name| json!({ "id": name, "cert_common_names": [name] })).collect();
    denying_else(&rules, &subjects, &policies)
}

/// An access control that denies what no rule permits.
fn denying_else(rules: &[Value], subjects: &[Value], policies: &[Value]) -> Value {
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

/// What a hub says on its keys. An answer is judged by the key that was asked: one to a question for all hubs is let through.
const SAYING: [&str; 5] = ["put", "delete", "reply", "declare_queryable", "liveliness_token"];

fn rule(id: &str, flow: &str, messages: &[&str], keys: &[&str]) -> Value {
    json!({ "id": id, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys })
}

fn nothing() -> Value {
    json!({
        "id": "nothing", "permission": "deny", "flows": ["ingress"], "messages": ["put"], "key_exprs": ["v2x/nothing"],
    })
}

const EVERYTHING: [&str; 9] = [
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "declare_queryable",
    "reply",
    "liveliness_token",
    "declare_liveliness_subscriber",
    "liveliness_query",
];

/// Two hubs of a name pass on what the agents at either of them send, and what either of them publishes.
fn relaying() -> [Value; 2] {
    [rule("hub-gives", "ingress", &EVERYTHING, &["**"]), rule("hub-gets", "egress", &EVERYTHING, &["**"])]
}

/// What only this agent may say.
fn publishing(agent: &Holder, name: &str) -> [Value; 2] {
    let id = &agent.name;
    let mut keys = vec![format!("v2x/*/agent/{id}/detections"), format!("v2x/*/agent/{id}/sensor")];
    if agent.truth {
        keys.push(format!("v2x/*/sim/truth/{id}"));
    }
    let keys: Vec<_> = keys.iter().map(String::as_str).collect();
    [
        rule(&format!("{name} puts"), "ingress", &["put"], &keys),
        rule(
            &format!("{name} is alive"),
            "ingress",
            &["liveliness_token"],
            &[&format!("v2x/*/agent/{id}/alive"), &format!("v2x/*/agent/{id}/idle/*")],
        ),
    ]
}

const ASKING: [&str; 4] =
    ["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"];

/// What agents read of a hub. Its journal holds what other agents send.
const LISTS: [&str; 3] = ["v2x/*/hub/*/fused/**", "v2x/*/hub/*/status", "v2x/*/hub/*/alive"];

/// An agent reads the lists and the status of hubs, and not what other agents send. It learns who subscribes to what it
/// publishes.
fn reading_of_agents() -> [Value; 3] {
    let given = ["put", "reply", "liveliness_token", "declare_queryable"];
    let listeners = ["v2x/*/agent/**", "v2x/*/sim/truth/**"];
    [
        rule("lists-asked", "ingress", &ASKING, &LISTS),
        rule("lists-given", "egress", &given, &LISTS),
        rule("listeners-given", "egress", &["declare_subscriber"], &listeners),
    ]
}

/// A viewer reads everything: it may record a network, or look for what is under wrong keys (`v2x check`).
fn reading_of_viewers() -> [Value; 2] {
    let given = ["put", "reply", "liveliness_token", "declare_queryable", "declare_subscriber"];
    [rule("all-asked", "ingress", &ASKING, &["**"]), rule("all-given", "egress", &given, &["**"])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::{AgentId, HubId, NetworkId};
    use v2x_common::keys::Keys;
    use zenoh::key_expr::KeyExpr;

    fn holder(role: Role, name: &str) -> Holder {
        Holder {
            role,
            name: name.to_owned(),
            generation: 1,
            truth: false,
            expires_at: 0,
            revoked: false,
            connect: Vec::new(),
        }
    }

    fn control(holders: Vec<Holder>) -> Value {
        let register = Register { authority: "a".to_owned(), expires_at: 0, hubs: Vec::new(), holders };
        let (name, hosts) = (HubId::new("hub").unwrap(), Vec::new());
        access_control(&HubEntry { name, hosts, port: 7447, expires_at: 0 }, &register)
    }

    /// Whether the rules let somebody do something on a key.
    fn allows(control: &Value, subject: &str, flow: &str, message: &str, key: &str) -> bool {
        let has = |list: &Value, item: &str| list.as_array().unwrap().iter().any(|value| value == item);
        let policies = control["policies"].as_array().unwrap();
        let of_subject = policies.iter().filter(|policy| has(&policy["subjects"], subject));
        let names: Vec<_> = of_subject.flat_map(|policy| policy["rules"].as_array().unwrap()).collect();
        let key = KeyExpr::try_from(key).unwrap();
        control["rules"].as_array().unwrap().iter().any(|rule| {
            names.contains(&&rule["id"])
                && rule["permission"] == "allow"
                && has(&rule["flows"], flow)
                && has(&rule["messages"], message)
                && rule["key_exprs"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .any(|allowed| KeyExpr::try_from(allowed.as_str().unwrap()).unwrap().includes(&key))
        })
    }

    #[test]
    fn the_acl_lets_an_agent_put_under_its_own_name_only_and_a_viewer_nothing() {
        let control = control(vec![
            holder(Role::Agent, "ego"),
            holder(Role::Agent, "rsu"),
            holder(Role::Viewer, "eye"),
        ]);
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let [ego, rsu] = ["ego", "rsu"].map(|name| AgentId::new(name).unwrap());
        let hub = HubId::new("hub").unwrap();
        let puts = |subject: &str, key: &str| allows(&control, subject, "ingress", "put", key);
        assert!(puts("agent:ego", &keys.detections(&ego)) && puts("agent:ego", &keys.sensor(&ego)));
        let forbidden = [
            keys.detections(&rsu),
            keys.all_detections(),
            keys.any_detections(),
            keys.truth(&ego),
            keys.fused(&hub),
            keys.status(&hub),
            keys.delta(&hub),
            keys.beat(&hub),
            "v2x/**".to_owned(),
        ];
        for key in &forbidden {
            assert!(!puts("agent:ego", key) && !puts("viewers", key), "{key}");
        }
        for message in ["reply", "declare_queryable"] {
            assert!(!allows(&control, "agent:ego", "ingress", message, &keys.status(&hub)));
            assert!(!allows(&control, "viewers", "ingress", message, &keys.status(&hub)));
        }
        assert!(allows(&control, "agent:ego", "ingress", "liveliness_token", &keys.agent_alive(&ego)));
        assert!(!allows(&control, "viewers", "ingress", "liveliness_token", &keys.agent_alive(&ego)));
        let idle = |agent| keys.agent_idle(agent, "veh 7");
        assert!(allows(&control, "agent:ego", "ingress", "liveliness_token", &idle(&ego)));
        assert!(!allows(&control, "agent:ego", "ingress", "liveliness_token", &idle(&rsu)));
    }

    #[test]
    fn the_acl_lets_viewers_read_all_and_agents_what_hubs_publish() {
        let control = control(vec![holder(Role::Agent, "ego"), holder(Role::Viewer, "eye")]);
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let asks =
            |subject: &str, message: &str, key: &str| allows(&control, subject, "ingress", message, key);
        for key in [keys.all_fused(), keys.all_lagged(), keys.all_deltas()] {
            assert!(
                asks("agent:ego", "declare_subscriber", &key) && asks("viewers", "declare_subscriber", &key)
            );
        }
        let journals =
            [keys.journal(&HubId::new("hub").unwrap()), keys.all_journals(), "v2x/demo/hub/**".to_owned()];
        let of_others = [keys.all_detections(), keys.all_sensors(), keys.all_truth(), "**".to_owned()];
        for key in of_others.iter().chain(&journals) {
            for message in ["declare_subscriber", "query"] {
                assert!(!asks("agent:ego", message, key) && asks("viewers", message, key), "{message} {key}");
            }
            assert!(!allows(&control, "agent:ego", "egress", "put", key), "{key}");
        }
        assert!(
            asks("viewers", "query", &keys.all_status()) && asks("agent:ego", "query", &keys.all_status())
        );
        assert!(asks("viewers", "declare_liveliness_subscriber", &keys.all_agents_alive()));
        // The agent knows that somebody listens.
        assert!(allows(&control, "agent:ego", "egress", "declare_subscriber", &keys.any_detections()));
    }

    #[test]
    fn the_acl_of_a_hub_lets_the_standby_with_its_own_certificate_pass_all_on_and_no_other_hub() {
        let control = control(vec![holder(Role::Agent, "ego")]);
        for key in ["v2x/demo/agent/ego/detections", "v2x/demo/hub/hub/fused", "v2x/demo/hub/hub/alive"] {
            for (flow, message) in [("ingress", "put"), ("egress", "put"), ("ingress", "liveliness_token")] {
                assert!(allows(&control, "same hub", flow, message, key), "{flow} {message} {key}");
            }
        }
        assert!(!allows(&control, "agent:ego", "ingress", "put", "v2x/demo/hub/hub/fused"));
        let names =
            control["subjects"].as_array().unwrap().iter().map(|subject| &subject["cert_common_names"]);
        let hubs: Vec<_> = names.filter(|names| names.to_string().contains("hub:")).collect();
        assert_eq!(hubs, [&json!(["hub:hub"])]);
    }

    #[test]
    fn the_acl_of_a_client_believes_the_hubs_of_its_authority_each_for_itself() {
        let hub = |name: &str| HubEntry {
            name: HubId::new(name).unwrap(),
            hosts: Vec::new(),
            port: 7447,
            expires_at: 0,
        };
        let denies = |control: &Value, subject: &str, key: &str| {
            let of_subject = control["policies"].as_array().unwrap().iter();
            let has = |list: &Value, item: &Value| list.as_array().unwrap().contains(item);
            let of_subject = of_subject.filter(|policy| has(&policy["subjects"], &subject.into()));
            let names: Vec<_> = of_subject.flat_map(|policy| policy["rules"].as_array().unwrap()).collect();
            let key = KeyExpr::try_from(key).unwrap();
            control["rules"].as_array().unwrap().iter().any(|rule| {
                let on = KeyExpr::try_from(rule["key_exprs"][0].as_str().unwrap()).unwrap();
                names.contains(&&rule["id"]) && rule["permission"] == "deny" && on.includes(&key)
            })
        };
        let control = believing(&[hub("north"), hub("south")]);
        assert!(allows(&control, "hub:north", "ingress", "put", "v2x/demo/hub/north/fused"));
        assert!(allows(&control, "hub:north", "egress", "put", "v2x/demo/agent/ego/detections"));
        assert!(!denies(&control, "hub:north", "v2x/demo/hub/north/fused"));
        assert!(denies(&control, "hub:south", "v2x/demo/hub/north/fused"));
        assert!(denies(&control, "hub:north", "v2x/demo/hub/south/fused/delta"));
        assert!(!allows(&control, "agent:eve", "ingress", "put", "v2x/demo/hub/north/fused"));
        // A router has the certificate, and passes on what a hub says that has none of its own.
        let control = believing(&[hub("router")]);
        assert!(allows(&control, "hub:router", "ingress", "put", "v2x/demo/hub/north/fused"));
        assert!(!denies(&control, "hub:router", "v2x/demo/hub/north/fused"));
        assert_eq!(control["subjects"].as_array().unwrap().len(), 1);
    }

    #[test]
    fn a_revoked_certificate_is_in_no_acl_rule_and_its_successor_has_another_name() {
        let mut ego = holder(Role::Agent, "ego");
        ego.revoked = true;
        assert!(!control(vec![ego.clone()]).to_string().contains("agent:ego"));
        let again = Holder { generation: 2, revoked: false, ..ego };
        assert_eq!(again.common_name(), "agent:ego/2");
        let control = control(vec![again]);
        assert!(allows(&control, "agent:ego/2", "ingress", "put", "v2x/demo/agent/ego/detections"));
        assert!(!control.to_string().contains("\"agent:ego\""));
    }
}

//! Whether a hub is one that a client believes, by the name in its certificate.
//!
//! Zenoh's TLS checks the address, and trusts the authorities of the web besides ours. Its access control knows the name in
//! the certificate: a client's configuration of `v2x certs` has one that denies everything to and from a hub of another name.
//! Zenoh says so to nobody; here it is said.

use serde_json::Value;
use std::collections::BTreeSet;
use zenoh::{Config, Session};

/// The names of certificates that a client's access control lets speak; `None` where it also lets others.
fn names(config: &Config) -> Option<BTreeSet<String>> {
    let read = |key: &str| serde_json::from_str::<Value>(&config.get_json(key).ok()?).ok();
    let is = |key: &str, value: Value| read(key).is_some_and(|read| read == value);
    if !is("mode", "client".into())
        || !is("access_control/enabled", true.into())
        || !is("access_control/default_permission", "deny".into())
    {
        return None;
    }
    let subjects = read("access_control/subjects")?;
    let mut names = BTreeSet::new();
    for subject in subjects.as_array()? {
        let of_subject = subject["cert_common_names"].as_array()?;
        names.extend(of_subject.iter().filter_map(Value::as_str).map(str::to_owned));
    }
    Some(names)
}

/// Why a client believes nothing of what it is connected to; `None` where it does.
pub(in crate::net) async fn why_not_believed(session: &Session, config: &Config) -> Option<String> {
    let names = names(config)?;
    for link in session.info().links().await {
        let name = link.auth_identifier().unwrap_or_default();
        if !names.contains(name) {
            return Some(words(&link.dst().to_string(), name, &names));
        }
    }
    None
}

fn words(endpoint: &str, name: &str, believed: &BTreeSet<String>) -> String {
    let believed: Vec<_> = believed.iter().map(String::as_str).collect();
    let believed = believed.join(", ");
    let who = if name.is_empty() {
        "it shows no certificate with a name".to_owned()
    } else {
        format!("its certificate is of {name:?}")
    };
    format!(
        "{endpoint}: {who}, and this configuration believes {believed} alone: connect to that hub by tls/, or make the \
         configuration again where the certificates are made (`v2x certs agent NAME --renew`, `v2x certs viewer NAME --renew`)"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_of(json5: &str) -> Option<Vec<String>> {
        names(&Config::from_json5(json5).unwrap()).map(|names| names.into_iter().collect())
    }

    #[test]
    fn only_a_client_whose_acl_denies_all_others_believes_certain_names_alone() {
        let config = |mode: &str, default: &str, subjects: &str| {
            names_of(&format!(
                r#"{{ mode: "{mode}", access_control: {{ enabled: true, default_permission: "{default}", rules: [], policies: [],
                     subjects: [{subjects}] }} }}"#
            ))
        };
        let hub = r#"{ id: "a", cert_common_names: ["hub:a", "hub:b"] }"#;
        assert_eq!(config("client", "deny", hub), Some(vec!["hub:a".to_owned(), "hub:b".to_owned()]));
        assert_eq!(config("client", "allow", hub), None);
        assert_eq!(config("router", "deny", hub), None);
        assert_eq!(config("client", "deny", &format!(r#"{hub}, {{ id: "anybody" }}"#)), None);
        assert_eq!(names_of(r#"{ mode: "client" }"#), None);
    }

    #[test]
    fn a_cert_that_is_not_believed_is_named_with_both_names_and_what_to_do() {
        let believed = BTreeSet::from(["hub:north".to_owned()]);
        let said = words("tls/10.0.0.1:7447", "hub:south", &believed);
        for part in ["tls/10.0.0.1:7447", "\"hub:south\"", "hub:north alone", "--renew"] {
            assert!(said.contains(part), "{said}");
        }
        assert!(words("tcp/10.0.0.1:7447", "", &believed).contains("no certificate"));
    }
}

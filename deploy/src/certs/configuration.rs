//! The Zenoh configurations of a hub, an agent and a viewer. They are JSON with a comment, which is JSON5.

use super::access::access_control;
use super::register::{HubEntry, Register};
use anyhow::Context;
use serde_json::{Map, Value, json};
use v2x_common::net::session::{ZenohOption, client_options, hub_options};

/// The file's name, in the folder of whom it is for.
pub(super) const FILE: &str = "zenoh.json5";
/// The other files of that folder.
pub(super) const KEY: &str = "key.pem";
/// The certificate of whom the folder is for.
pub(super) const CERTIFICATE: &str = "certificate.pem";

/// A hub's.
pub(super) fn of_hub(hub: &HubEntry, register: &Register) -> anyhow::Result<String> {
    let mut config = nested(&hub_options(&[listen(hub)]))?;
    config["access_control"] = access_control(hub, register);
    config["transport"]["link"]["protocols"] = json!(["tls"]);
    config["transport"]["link"]["tls"] = json!({
        "root_ca_certificate": super::authority::CERTIFICATE,
        "listen_certificate": CERTIFICATE,
        "listen_private_key": KEY,
        "connect_certificate": CERTIFICATE,
        "connect_private_key": KEY,
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    });
    with_comment(
        &config,
        "The hub's. `v2x certs` writes it anew when somebody gets a certificate or loses it; a running hub follows.",
    )
}

/// An agent's or a viewer's.
pub(super) fn of_client(register: &Register) -> anyhow::Result<String> {
    let hubs: Vec<_> = register.hubs.iter().map(connect).collect();
    let mut config = nested(&client_options(&hubs))?;
    config["transport"]["link"]["tls"] = json!({
        "root_ca_certificate": super::authority::CERTIFICATE,
        "connect_certificate": CERTIFICATE,
        "connect_private_key": KEY,
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    });
    with_comment(&config, "Its files are looked for beside it: the folder can be copied as a whole.")
}

fn with_comment(config: &Value, comment: &str) -> anyhow::Result<String> {
    Ok(format!("// {comment}\n{}\n", serde_json::to_string_pretty(config)?))
}

/// On this machine only where the hub is reached by no other address.
fn listen(hub: &HubEntry) -> String {
    let is_local = hub.hosts.iter().all(|host| matches!(host.as_str(), "127.0.0.1" | "localhost"));
    format!("tls/{}:{}", if is_local { "127.0.0.1" } else { "0.0.0.0" }, hub.port)
}

fn connect(hub: &HubEntry) -> String {
    format!("tls/{}:{}", hub.hosts.first().map_or("127.0.0.1", String::as_str), hub.port)
}

/// Options by their places as one document.
fn nested(options: &[ZenohOption]) -> anyhow::Result<Value> {
    let mut document = Value::Object(Map::new());
    for (place, json) in options {
        let value: Value = serde_json::from_str(json).with_context(|| format!("{place} = {json}"))?;
        let at = place.split('/').fold(&mut document, |at, key| &mut at[key]);
        match (at, value) {
            (Value::Object(there), Value::Object(more)) => there.extend(more),
            (at, value) => *at = value,
        }
    }
    Ok(document)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certs::register::{Holder, Role};
    use v2x_common::id::HubId;
    use v2x_common::net::session::{self, SessionOptions};

    #[test]
    fn zenoh_reads_the_tls_and_acl_configurations_with_the_options_of_every_session() {
        let hub = HubEntry {
            name: HubId::new("hub").unwrap(),
            hosts: vec!["192.168.1.10".to_owned()],
            port: 7448,
            expires_at: 0,
        };
        let ego = Holder {
            role: Role::Agent,
            name: "ego".into(),
            generation: 1,
            truth: true,
            expires_at: 0,
            revoked: false,
        };
        let register =
            Register { authority: "a".into(), expires_at: 0, hubs: vec![hub.clone()], holders: vec![ego] };
        let read = |text: String| zenoh::Config::from_json5(&text).unwrap();
        let (hub, client) = (read(of_hub(&hub, &register).unwrap()), read(of_client(&register).unwrap()));
        let plain = session::hub_config(&SessionOptions::default()).unwrap();
        for key in [
            "mode",
            "transport/unicast",
            "scouting",
            "transport/link/tx",
            "transport/link/rx",
            "timestamping",
        ] {
            assert_eq!(hub.get_json(key).unwrap(), plain.get_json(key).unwrap(), "{key}");
        }
        let plain = session::client_config(&SessionOptions::default()).unwrap();
        for key in ["mode", "connect/timeout_ms", "connect/retry", "scouting", "transport/link/tx"] {
            assert_eq!(client.get_json(key).unwrap(), plain.get_json(key).unwrap(), "{key}");
        }
        assert_eq!(session::listen_endpoints(&hub), ["tls/0.0.0.0:7448"]);
        assert!(client.get_json("connect/endpoints").unwrap().contains("tls/192.168.1.10:7448"));
        assert_eq!(hub.get_json("access_control/default_permission").unwrap(), "\"deny\"");
        assert_eq!(hub.get_json("transport/link/tls/enable_mtls").unwrap(), "true");
    }
}

//! The Zenoh configurations of a hub, an agent and a viewer. They are JSON with a comment, which is JSON5.

use super::access::{access_control, believing};
use super::register::{Holder, HubEntry, Register};
use anyhow::{Context, bail};
use serde_json::{Map, Value, json};
use std::net::IpAddr;
use v2x_common::net::endpoint;
use v2x_common::net::session::{ZenohOption, client_options, hub_options};

/// The file's name, in the folder of whom it is for.
pub(super) const FILE: &str = "zenoh.json5";
/// The other files of that folder.
pub(super) const KEY: &str = "key.pem";
/// The certificate of whom the folder is for.
pub(super) const CERTIFICATE: &str = "certificate.pem";

/// A hub's.
pub(super) fn of_hub(hub: &HubEntry, register: &Register) -> anyhow::Result<String> {
    let mut config = nested(&hub_options(&listen(hub)))?;
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
pub(super) fn of_client(holder: &Holder, register: &Register) -> anyhow::Result<String> {
    let mut config = nested(&client_options(&connect(&holder.connect, register)?))?;
    config["access_control"] = believing(&register.hubs);
    config["transport"]["link"]["protocols"] = json!(["tls"]);
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
fn listen(hub: &HubEntry) -> Vec<String> {
    let is_ipv6 = |host: &&String| host.parse::<IpAddr>().is_ok_and(|ip| ip.is_ipv6());
    let is_of_this_machine =
        |host: &String| host == "localhost" || host.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback());
    let has_ipv6 = hub.hosts.iter().any(|host| is_ipv6(&host));
    let at = |host: &str| format!("tls/{}", endpoint::address(host, hub.port));
    if !hub.hosts.iter().all(is_of_this_machine) {
        // By the second one IPv4 is served, too.
        return vec![at(if has_ipv6 { "::" } else { "0.0.0.0" })];
    }
    let has_ipv4 = !hub.hosts.iter().all(|host| is_ipv6(&host));
    let own = [has_ipv4.then(|| at("127.0.0.1")), has_ipv6.then(|| at("::1"))];
    own.into_iter().flatten().collect()
}

/// The endpoints of hubs: all hosts, or these in their order.
fn connect(hosts: &[String], register: &Register) -> anyhow::Result<Vec<String>> {
    let all = register.hubs.iter().flat_map(|hub| hub.hosts.iter().map(move |host| (host, hub.port)));
    let all: Vec<_> = all.collect();
    // Other clients than ours read this file, too: an IPv6 address as Zenoh's TLS takes it.
    let at = |(host, port): (&String, u16)| {
        let bracketed = format!("tls/{}", endpoint::address(host, port));
        endpoint::for_clients(&bracketed).into_owned()
    };
    if hosts.is_empty() {
        return Ok(all.into_iter().map(at).collect());
    }
    let mut endpoints = Vec::new();
    for host in hosts {
        let of_host: Vec<_> = all.iter().filter(|(known, _)| *known == host).copied().map(at).collect();
        if of_host.is_empty() {
            let known: Vec<_> = all.iter().map(|(host, _)| host.as_str()).collect();
            bail!(
                "--connect {host}: no hub's certificate is for it; there are {}; `v2x certs hub NAME --host ... --renew` adds one",
                known.join(", ")
            );
        }
        endpoints.extend(of_host);
    }
    Ok(endpoints)
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
    use crate::certs::register::Role;
    use v2x_common::id::HubId;
    use v2x_common::net::session::{self, SessionOptions};

    fn hub(name: &str, hosts: &[&str]) -> HubEntry {
        let hosts = hosts.iter().map(|host| (*host).to_owned()).collect();
        HubEntry { name: HubId::new(name).unwrap(), hosts, port: 7448, expires_at: 0 }
    }

    fn ego(connect: &[&str]) -> Holder {
        Holder {
            role: Role::Agent,
            name: "ego".into(),
            generation: 1,
            truth: true,
            expires_at: 0,
            revoked: false,
            connect: connect.iter().map(|host| (*host).to_owned()).collect(),
        }
    }

    fn register(hubs: &[HubEntry]) -> Register {
        Register { authority: "a".into(), expires_at: 0, hubs: hubs.to_vec(), holders: vec![ego(&[])] }
    }

    #[test]
    fn zenoh_reads_the_tls_and_acl_configurations_with_the_options_of_every_session() {
        let hub = hub("hub", &["192.168.1.10"]);
        let register = register(std::slice::from_ref(&hub));
        let read = |text: String| zenoh::Config::from_json5(&text).unwrap();
        let (hub, client) =
            (read(of_hub(&hub, &register).unwrap()), read(of_client(&ego(&[]), &register).unwrap()));
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
        assert_eq!(hub.get_json("transport/link/tls/enable_mtls").unwrap(), "true");
        for config in [&hub, &client] {
            assert_eq!(config.get_json("access_control/default_permission").unwrap(), "\"deny\"");
            assert_eq!(config.get_json("transport/link/protocols").unwrap(), "[\"tls\"]");
        }
    }

    #[test]
    fn certs_name_every_address_of_every_hub_or_those_that_are_chosen_in_their_order() {
        let register = register(&[hub("hub", &["10.0.0.1", "10.0.0.2"]), hub("far", &["2001:db8::7"])]);
        let of = |hosts: &[&str]| connect(&ego(hosts).connect, &register);
        assert_eq!(of(&[]).unwrap(), ["tls/10.0.0.1:7448", "tls/10.0.0.2:7448", "tls/2001:db8::7:7448"]);
        assert_eq!(of(&["10.0.0.2", "10.0.0.1"]).unwrap(), ["tls/10.0.0.2:7448", "tls/10.0.0.1:7448"]);
        let refused = of(&["10.0.0.3"]).unwrap_err().to_string();
        assert!(refused.contains("10.0.0.3") && refused.contains("10.0.0.1, 10.0.0.2"), "{refused}");
    }

    #[test]
    fn certs_of_ipv6_addresses_make_the_hub_listen_there() {
        assert_eq!(listen(&hub("hub", &["127.0.0.1", "localhost"])), ["tls/127.0.0.1:7448"]);
        assert_eq!(listen(&hub("hub", &["::1"])), ["tls/[::1]:7448"]);
        assert_eq!(listen(&hub("hub", &["127.0.0.1", "::1"])), ["tls/127.0.0.1:7448", "tls/[::1]:7448"]);
        assert_eq!(listen(&hub("hub", &["2001:db8::7", "10.0.0.1"])), ["tls/[::]:7448"]);
        assert_eq!(listen(&hub("hub", &["10.0.0.1", "localhost"])), ["tls/0.0.0.0:7448"]);
    }
}

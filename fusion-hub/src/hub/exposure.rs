//! Whether anybody on the network can publish as anybody.

use v2x_common::net::endpoint::{self, Endpoint};
use v2x_common::net::session;
use zenoh::Config;

const ADVICE: &str =
    "`v2x certs init --host ADDRESS` makes certificates and a configuration for --zenoh-config";

/// What is to be said about who can take part; `None` where only holders of certificates can, or only this machine.
pub(super) fn warning(config: &Config) -> Option<String> {
    let is_set = |key: &str| config.get_json(key).is_ok_and(|value| value == "true");
    let exposed: Vec<_> = session::listen_endpoints(config).into_iter().filter(|at| !is_local(at)).collect();
    if exposed.is_empty() {
        return None;
    }
    let (open, secured): (Vec<_>, Vec<_>) = exposed
        .into_iter()
        .partition(|endpoint| !endpoint.starts_with("tls/") || endpoint.contains("enable_mtls="));
    let who = if !open.is_empty() || !is_set("transport/link/tls/enable_mtls") {
        "everybody who reaches"
    } else if !is_set("access_control/enabled") || !denies(config) {
        "every holder of a certificate who reaches"
    } else {
        return None;
    };
    let at = endpoint::all_shown(if open.is_empty() { &secured } else { &open });
    Some(format!("{who} {at} can publish as any agent and any hub, and read everything; {ADVICE}"))
}

/// Whether the access control denies what no rule allows.
fn denies(config: &Config) -> bool {
    config.get_json("access_control/default_permission").is_ok_and(|value| value == "\"deny\"")
}

/// Whether only this machine reaches an endpoint.
fn is_local(endpoint: &str) -> bool {
    endpoint.starts_with("unix")
        || Endpoint::read(endpoint).is_some_and(|endpoint| endpoint.is_of_this_machine())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warning_of(json5: &str) -> Option<String> {
        warning(&Config::from_json5(json5).unwrap())
    }

    #[test]
    fn a_hub_without_tls_is_warned_of_where_others_reach_it() {
        for local in ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tcp/localhost:7447#so_sndbuf=9"] {
            assert_eq!(warning_of(&format!("{{ listen: {{ endpoints: [{local:?}] }} }}")), None, "{local}");
        }
        assert_eq!(warning_of("{ mode: \"client\" }"), None, "it listens nowhere");
        assert!(warning_of("{ mode: \"router\" }").is_some_and(|words| words.contains("tcp/[::]:7447")));
        let warning =
            warning_of(r#"{ listen: { endpoints: ["tcp/127.0.0.1:1", "tcp/0.0.0.0:7447"] } }"#).unwrap();
        assert!(warning.contains("tcp/0.0.0.0:7447") && warning.contains("v2x certs init"), "{warning}");
    }

    #[test]
    fn tls_alone_is_not_enough_without_client_certificates_or_acl() {
        let with = |mutual: bool, acl: bool| {
            warning_of(&format!(
                r#"{{ listen: {{ endpoints: ["tls/0.0.0.0:1"] }}, transport: {{ link: {{ tls: {{ enable_mtls: {mutual} }} }} }},
                     access_control: {{ enabled: {acl}, default_permission: "deny" }} }}"#
            ))
        };
        assert!(with(false, true).unwrap().contains("everybody"));
        assert!(with(true, false).unwrap().contains("every holder"));
        assert_eq!(with(true, true), None);
        let allowing = r#"{ listen: { endpoints: ["tls/0.0.0.0:1"] }, transport: { link: { tls: { enable_mtls: true } } },
             access_control: { enabled: true, default_permission: "allow" } }"#;
        assert!(warning_of(allowing).unwrap().contains("every holder"));
        let with_key =
            warning_of(r#"{ listen: { endpoints: ["tls/0.0.0.0:1#listen_private_key_base64=c2VjcmV0"] } }"#);
        assert!(
            with_key.is_some_and(|words| words.contains("tls/0.0.0.0:1#") && !words.contains("c2VjcmV0"))
        );
        let by_endpoint = r#"{ listen: { endpoints: ["tls/0.0.0.0:1#enable_mtls=false"] }, transport: { link: { tls: { enable_mtls: true } } } }"#;
        assert!(warning_of(by_endpoint).unwrap().contains("everybody"));
    }
}

//! `v2x certs list`.

use super::authority::{day, now};
use super::register::{Holder, HubEntry, Register};
use crate::output;
use serde_json::{Value, json};

pub(super) fn print(register: &Register, as_json: bool) -> anyhow::Result<()> {
    let text = if as_json { in_json(register).to_string() + "\n" } else { table(register, now()) };
    output::print(&text).map(drop)
}

fn in_json(register: &Register) -> Value {
    let holders = register.holders.iter().map(|holder| {
        let Holder { role, name, expires_at, revoked, .. } = holder;
        json!({
            "role": role, "name": name, "common_name": holder.common_name(), "expires_at": expires_at, "revoked": revoked,
        })
    });
    json!({
        "authority": register.authority,
        "expires_at": register.expires_at,
        "hubs": register.hubs,
        "holders": holders.collect::<Vec<_>>(),
    })
}

fn table(register: &Register, now: i64) -> String {
    let line = |role: &str, name: &str, expires_at: i64, remark: &str| {
        let remark = if remark.is_empty() && expires_at <= now { "expired" } else { remark };
        let line = format!("{role:<9} {name:<32} {}  {remark}", day(expires_at));
        line.trim_end().to_owned() + "\n"
    };
    let mut text = line("authority", "", register.expires_at, "");
    for HubEntry { name, hosts, expires_at, .. } in &register.hubs {
        let hosts = if *expires_at > now { hosts.join(", ") } else { String::new() };
        text += &line("hub", name.as_str(), *expires_at, &hosts);
    }
    for Holder { role, name, expires_at, revoked, .. } in &register.holders {
        text += &line(&role.to_string(), name, *expires_at, if *revoked { "revoked" } else { "" });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certs::register::Role;

    #[test]
    fn expired_and_revoked_certs_are_distinguished() {
        let holder = |name: &str, expires_at, revoked| Holder {
            role: Role::Agent,
            name: name.to_owned(),
            generation: 1,
            truth: false,
            expires_at,
            revoked,
            connect: Vec::new(),
        };
        let holders = vec![holder("good", 200, false), holder("old", 50, false), holder("bad", 200, true)];
        let register = Register { authority: "a".into(), expires_at: 1_000, hubs: Vec::new(), holders };
        let text = table(&register, 100);
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[1].ends_with("1970-01-01") && lines[1].contains("good"), "{text}");
        assert!(lines[2].ends_with("expired") && lines[3].ends_with("revoked"), "{text}");
    }
}

//! What `v2x certs` does.

use super::args::{Action, AgentArgs, CertsArgs, HubArgs, InitArgs, PlaceArgs, ViewerArgs, only_one};
use super::authority::{self, Authority, Identity, Purpose, day};
use super::register::{self, Holder, HubEntry, Register, Role};
use super::{configuration, files, list};
use anyhow::bail;
use std::io::Write;
use std::path::{Path, PathBuf};
use v2x_common::id::HubId;

pub(crate) fn run(args: &CertsArgs) -> anyhow::Result<()> {
    let dir = &args.dir;
    // Two commands at a time would lose what one of them changes: a revocation, say.
    let _lock = match &args.action {
        Action::Init(_) | Action::List(_) => None,
        _ => Some(register::lock(dir)?),
    };
    match &args.action {
        Action::Init(init_args) => init(init_args.folder.as_ref().unwrap_or(dir), init_args),
        Action::Hub(hub_args) => add_hub(dir, hub_args),
        Action::Agent(agent) => add_holder(dir, &Request::from(agent)),
        Action::Viewer(viewer) => add_holder(dir, &Request::from(viewer)),
        Action::Revoke(revoked) => revoke(dir, &revoked.name),
        Action::List(list_args) => list::print(&Register::read(dir)?, list_args.json),
    }
}

/// Life-cycle news for people, on standard error. A closed one is no fault of ours.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

fn init(dir: &Path, args: &InitArgs) -> anyhow::Result<()> {
    if dir.join(register::FILE).exists() {
        bail!(
            "{} has an authority; make a hub's certificate by `v2x certs hub`, or name another folder",
            dir.display()
        );
    }
    if dir.join(authority::KEY).exists() {
        bail!(
            "{0} has the key of an authority, and no {1}, which says who has a certificate of it: bring that back from a backup; where \
             `v2x certs init` was interrupted, remove the folder, and try again",
            dir.display(),
            register::FILE
        );
    }
    files::private_folder(dir)?;
    files::keep_out_of_repositories(dir)?;
    let name = format!("v2x authority {}", authority::now());
    let expires_at = authority::make(dir, &name, args.authority_days)?;
    say(&format!("{}: an authority, valid until {}", dir.display(), day(expires_at)));
    let mut register = Register { authority: name, expires_at, hubs: Vec::new(), holders: Vec::new() };
    let hosts = hosts_of(&[], &args.place.host, &[])?;
    issue_hub(dir, &mut register, Place::new(args.name, hosts, &args.place, None))?;
    say("keep authority-key.pem to yourself: whoever has it can make certificates for anybody");
    say(&format!("next: v2x certs --dir {} agent NAME, for each agent", dir.display()));
    Ok(())
}

fn add_hub(dir: &Path, args: &HubArgs) -> anyhow::Result<()> {
    let mut register = Register::read(dir)?;
    refuse_edited(dir, &register)?;
    let folder = dir.join("hub").join(args.name.as_str());
    if folder.exists() && !args.renew {
        bail!("{} exists; give --renew to replace its certificate and key", folder.display());
    }
    let registered = register.hubs.iter().find(|hub| hub.name == args.name).cloned();
    let known = registered.as_ref().map_or(&[][..], |hub| &hub.hosts[..]);
    let hosts = hosts_of(known, &args.place.host, &args.drop)?;
    if !args.drop.is_empty() {
        say(&format!(
            "dropped: {}; clients that know the hub by that alone need --renew",
            args.drop.join(", ")
        ));
    }
    register.hubs.retain(|hub| hub.name != args.name);
    issue_hub(dir, &mut register, Place::new(args.name, hosts, &args.place, registered.as_ref()))
}

/// The addresses of a hub: those that it is given, then those that it had, but for those that are dropped. Clients try them in
/// this order.
fn hosts_of(registered: &[String], given: &[String], dropped: &[String]) -> anyhow::Result<Vec<String>> {
    const OWN: [&str; 2] = ["127.0.0.1", "localhost"];
    if let Some(unknown) = dropped.iter().find(|host| !registered.contains(host)) {
        bail!("--drop {unknown}: the hub has {}", registered.join(", "));
    }
    let kept = registered.iter().filter(|host| !given.contains(host) && !dropped.contains(host));
    let hosts: Vec<_> = given.iter().chain(kept).cloned().collect();
    match &hosts[..] {
        [] if !dropped.is_empty() => {
            bail!("--drop leaves the hub without an address: give it another one by --host")
        }
        [] => Ok(OWN.map(str::to_owned).to_vec()),
        _ => Ok(hosts),
    }
}

/// Where a hub is to be, and for how long.
struct Place {
    name: HubId,
    hosts: Vec<String>,
    port: u16,
    days: f64,
}

impl Place {
    const PORT: u16 = 7447;

    /// A port that is not given is the one that the hub had.
    fn new(name: HubId, hosts: Vec<String>, given: &PlaceArgs, registered: Option<&HubEntry>) -> Self {
        let port = given.port.or(registered.map(|hub| hub.port)).unwrap_or(Self::PORT);
        Self { name, hosts, port, days: given.days }
    }
}

/// Makes a hub's certificate, and its configuration.
fn issue_hub(dir: &Path, register: &mut Register, place: Place) -> anyhow::Result<()> {
    let Place { name, hosts, port, days } = place;
    let authority = Authority::open(dir, &register.authority, register.expires_at)?;
    let identity = authority.issue(&register::hub_common_name(name), &Purpose::Hub(&hosts), days)?;
    let folder = dir.join("hub").join(name.as_str());
    write_identity(&folder, &authority, &identity)?;
    let expires_at = identity.expires_at;
    say(&format!(
        "{}: the hub {name} at {}, port {port}, valid until {}",
        folder.display(),
        hosts.join(", "),
        day(expires_at)
    ));
    register.hubs.push(HubEntry { name, hosts, port, expires_at });
    register.write(dir)?;
    // Also where its text is as before: by it a hub that runs learns of its new certificate.
    write_hub_configurations(dir, register, Some(name))?;
    say(&format!(
        "start it: v2x hub --id {name} --zenoh-config {}",
        folder.join(configuration::FILE).display()
    ));
    Ok(())
}

/// Somebody who is to get a certificate.
struct Request {
    role: Role,
    name: String,
    truth: bool,
    days: f64,
    renew: bool,
    connect: Vec<String>,
}

impl From<&AgentArgs> for Request {
    fn from(args: &AgentArgs) -> Self {
        let AgentArgs { name, truth, days, ref connect, renew } = *args;
        Self { role: Role::Agent, name: name.to_string(), truth, days, renew, connect: connect.clone() }
    }
}

impl From<&ViewerArgs> for Request {
    fn from(args: &ViewerArgs) -> Self {
        let ViewerArgs { name, days, connect, renew } = args;
        let connect = connect.clone();
        Self { role: Role::Viewer, name: name.clone(), truth: false, days: *days, renew: *renew, connect }
    }
}

fn add_holder(dir: &Path, request: &Request) -> anyhow::Result<()> {
    let Request { role, name, truth, days, renew, connect } = request;
    let mut register = Register::read(dir)?;
    refuse_edited(dir, &register)?;
    let authority = Authority::open(dir, &register.authority, register.expires_at)?;
    let mut holder = Holder {
        role: *role,
        name: name.clone(),
        generation: 1,
        truth: *truth,
        expires_at: 0,
        revoked: false,
        connect: connect.clone(),
    };
    if let Some(known) = register.holder(*role, name) {
        if !known.revoked && !renew {
            bail!(
                "{role} {name} has a certificate, valid until {}; give --renew to replace it and its key",
                day(known.expires_at)
            );
        }
        // A revoked certificate stays out: the new one has another common name.
        holder.generation = known.generation + u32::from(known.revoked);
        holder.truth |= known.truth && !known.revoked;
        if connect.is_empty() {
            holder.connect.clone_from(&known.connect);
        }
    }
    let config = configuration::of_client(&holder, &register)?;
    let identity = authority.issue(&holder.common_name(), &Purpose::Client, *days)?;
    holder.expires_at = identity.expires_at;
    let folder = folder_of(dir, &holder);
    write_identity(&folder, &authority, &identity)?;
    files::replace(&folder.join(configuration::FILE), &config)?;
    say(&format!("{}: {role} {name}, valid until {}", folder.display(), day(holder.expires_at)));
    match register.holder(*role, name) {
        Some(known) => *known = holder,
        None => register.holders.push(holder),
    }
    register.write(dir)?;
    write_hub_configurations(dir, &register, None)?;
    let option = format!("--zenoh-config {}", folder.join(configuration::FILE).display());
    let command = match role {
        Role::Agent => format!("agent --scenario FILE --id {name}"),
        Role::Viewer => "watch".to_owned(),
    };
    say(&format!("copy the folder to its machine; there: v2x {command} {option}"));
    Ok(())
}

fn revoke(dir: &Path, name: &str) -> anyhow::Result<()> {
    let mut register = Register::read(dir)?;
    keep_edited(dir, &register)?;
    let holder = only_one(name, &mut register.holders)?;
    // Of one that is revoked already the configurations are written again: perhaps that failed.
    holder.revoked = true;
    let (role, name) = (holder.role, holder.name.clone());
    register.write(dir)?;
    write_hub_configurations(dir, &register, None)?;
    say(&format!(
        "{role} {name} is revoked: hubs that run with the configuration in {} follow within some seconds; copy it to those on \
         other machines",
        dir.join("hub").display()
    ));
    Ok(())
}

fn folder_of(dir: &Path, holder: &Holder) -> PathBuf {
    dir.join(holder.role.to_string()).join(&holder.name)
}

fn write_identity(folder: &Path, authority: &Authority, identity: &Identity) -> anyhow::Result<()> {
    files::private_folder(folder)?;
    files::replace(&folder.join(configuration::KEY), &identity.key)?;
    files::replace(&folder.join(configuration::CERTIFICATE), &identity.certificate)?;
    files::replace(&folder.join(authority::CERTIFICATE), authority.certificate())
}

fn hub_file(dir: &Path, hub: &HubEntry) -> PathBuf {
    dir.join("hub").join(hub.name.as_str()).join(configuration::FILE)
}

/// Writes those that change, and that of this hub; a hub that runs leaves its network for a moment when its own does. One that cannot be written
/// keeps none of the others from it.
fn write_hub_configurations(dir: &Path, register: &Register, renewed: Option<HubId>) -> anyhow::Result<()> {
    let mut failed = None;
    for hub in &register.hubs {
        let (path, text) = (hub_file(dir, hub), configuration::of_hub(hub, register)?);
        let is_same = || std::fs::read_to_string(&path).is_ok_and(|known| known == text);
        if renewed != Some(hub.name) && is_same() {
            continue;
        }
        if let Err(error) = files::replace(&path, &text) {
            say(&format!("{error:#}"));
            failed = Some(error);
        }
    }
    failed.map_or(Ok(()), Err)
}

/// Whether a hub's configuration is not the one of this register.
fn is_edited(dir: &Path, hub: &HubEntry, register: &Register) -> anyhow::Result<bool> {
    let expected = configuration::of_hub(hub, register)?;
    Ok(std::fs::read_to_string(hub_file(dir, hub)).is_ok_and(|text| text != expected))
}

/// A revocation is not kept back by what somebody has changed in a configuration: that is kept beside it.
fn keep_edited(dir: &Path, register: &Register) -> anyhow::Result<()> {
    for hub in &register.hubs {
        let path = hub_file(dir, hub);
        if is_edited(dir, hub, register)? {
            let kept = path.with_extension("json5.edited");
            files::replace(&kept, &std::fs::read_to_string(&path)?)?;
            say(&format!("{} was changed by hand: that is kept as {}", path.display(), kept.display()));
        }
    }
    Ok(())
}

/// Writing a hub's configuration anew would lose what somebody has changed in it.
fn refuse_edited(dir: &Path, register: &Register) -> anyhow::Result<()> {
    for hub in &register.hubs {
        let path = hub_file(dir, hub);
        if is_edited(dir, hub, register)? {
            bail!(
                "{} was changed by hand, and is to be written anew: move it away (or take its access_control from the new \
                 one), and try again",
                path.display()
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(hosts: &[&str]) -> Vec<String> {
        hosts.iter().map(|host| (*host).to_owned()).collect()
    }

    #[test]
    fn renewed_certs_of_a_hub_keep_its_addresses_and_lose_only_what_is_dropped_by_name() {
        let hosts = |registered: &[&str], given: &[&str], dropped: &[&str]| {
            hosts_of(&names(registered), &names(given), &names(dropped)).map_err(|error| error.to_string())
        };
        assert_eq!(hosts(&[], &[], &[]), Ok(names(&["127.0.0.1", "localhost"])));
        assert_eq!(hosts(&["a", "b"], &[], &[]), Ok(names(&["a", "b"])));
        assert_eq!(hosts(&["a", "b"], &["c", "b"], &[]), Ok(names(&["c", "b", "a"])));
        assert_eq!(hosts(&["a", "b"], &["c"], &["a"]), Ok(names(&["c", "b"])));
        assert!(hosts(&["a", "b"], &[], &["x"]).unwrap_err().contains("has a, b"));
        assert!(hosts(&["a"], &[], &["a"]).unwrap_err().contains("--host"));
    }
}

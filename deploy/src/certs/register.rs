//! Who has a certificate of an authority: the file `register.json` in its folder.

use super::files;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs::File;
use std::path::Path;
use v2x_common::id::HubId;

/// Everything that an authority has issued.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Register {
    /// Common name of the authority.
    pub(super) authority: String,
    /// Until when its own certificate is valid, s since the Unix epoch.
    pub(super) expires_at: i64,
    pub(super) hubs: Vec<HubEntry>,
    pub(super) holders: Vec<Holder>,
}

/// A hub.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HubEntry {
    pub(super) name: HubId,
    /// Addresses and DNS names of its certificate; clients connect to the first one that answers.
    pub(super) hosts: Vec<String>,
    pub(super) port: u16,
    /// s since the Unix epoch.
    pub(super) expires_at: i64,
}

/// Common name of a hub's certificate.
pub(super) fn hub_common_name(name: HubId) -> String {
    format!("hub:{name}")
}

/// What somebody may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Role {
    /// Publishes under its own name, and reads what hubs publish.
    Agent,
    /// Reads, and publishes nothing.
    Viewer,
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Agent => "agent",
            Self::Viewer => "viewer",
        })
    }
}

/// An agent or a viewer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Holder {
    pub(super) role: Role,
    pub(super) name: String,
    /// Counts up when somebody whose certificate was revoked gets another one: the old one is never let in again.
    pub(super) generation: u32,
    /// Whether an agent may publish the truth of a simulation.
    pub(super) truth: bool,
    /// s since the Unix epoch.
    pub(super) expires_at: i64,
    pub(super) revoked: bool,
    /// The hosts of hubs to which it connects, in this order; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) connect: Vec<String>,
}

impl Holder {
    /// Common name of the certificate, by which the hub's access control knows it.
    pub(super) fn common_name(&self) -> String {
        let Self { role, name, generation, .. } = self;
        // A name holds no `/`.
        if *generation == 1 { format!("{role}:{name}") } else { format!("{role}:{name}/{generation}") }
    }
}

/// Keeps other commands from changing a register until it is dropped.
pub(super) fn lock(folder: &Path) -> anyhow::Result<File> {
    // A folder without a register is no place for a lock.
    Register::read(folder)?;
    let path = folder.join("register.lock");
    let file = files::private(File::options().create(true).truncate(false).write(true)).open(&path);
    let file = file.with_context(|| format!("making {}", path.display()))?;
    file.lock().with_context(|| format!("locking {}", path.display()))?;
    Ok(file)
}

/// The file's name.
pub(super) const FILE: &str = "register.json";

impl Register {
    /// Of the authority in a folder.
    pub(super) fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(FILE);
        let text = std::fs::read_to_string(&path).with_context(|| {
            format!(
                "reading {}; make an authority by `v2x certs init`, or name its folder by --dir",
                path.display()
            )
        })?;
        serde_json::from_str(&text).with_context(|| format!("in {}", path.display()))
    }

    pub(super) fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        files::replace(&folder.join(FILE), &text)
    }

    /// The holder of this role and name, if there is one.
    pub(super) fn holder(&mut self, role: Role, name: &str) -> Option<&mut Holder> {
        self.holders.iter_mut().find(|holder| holder.role == role && holder.name == name)
    }

    /// Those whose certificates count.
    pub(super) fn admitted(&self, role: Role) -> impl Iterator<Item = &Holder> {
        self.holders.iter().filter(move |holder| holder.role == role && !holder.revoked)
    }
}

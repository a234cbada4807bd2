//! The credentials of a Zenoh configuration: what this build would ignore is refused, files are found and kept private.

use super::secrets::conceal;
use crate::net::endpoint;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ClientConfig, RootCertStore};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zenoh::Config;

const TLS: &str = "transport/link/tls";
/// The files that hold a private key.
const KEYS: [&str; 2] = ["listen_private_key", "connect_private_key"];
/// The files that anybody may read.
const CERTIFICATES: [&str; 3] = ["root_ca_certificate", "listen_certificate", "connect_certificate"];
/// Secrets that stand in the configuration itself.
const INLINE: [&str; 2] = ["listen_private_key_base64", "connect_private_key_base64"];
/// Ways to authenticate that this build has not, and that Zenoh ignores in silence then.
const UNSUPPORTED: [(&str, &str); 8] = [
    ("transport/auth/usrpwd/user", "a user name"),
    ("transport/auth/usrpwd/password", "a password"),
    ("transport/auth/usrpwd/dictionary_file", "a file of passwords"),
    ("transport/auth/pubkey/public_key_pem", "a public key"),
    ("transport/auth/pubkey/private_key_pem", "a key pair"),
    ("transport/auth/pubkey/public_key_file", "a public key"),
    ("transport/auth/pubkey/private_key_file", "a key pair"),
    ("transport/auth/pubkey/known_keys_file", "a file of known keys"),
];

/// Why the credentials of a configuration are not used.
#[derive(Debug, thiserror::Error)]
pub enum CredentialError {
    /// It authenticates in a way that this build does not know.
    #[error(
        "{key} is set: this build does not authenticate by {what}, and Zenoh would ignore it in silence; use certificates \
         (`v2x certs init`) and take it out"
    )]
    Unsupported {
        /// The key of the configuration.
        key: &'static str,
        /// What it is.
        what: &'static str,
    },
    /// Its access control knows users by name.
    #[error(
        "access_control: subject {subject:?} has usernames: this build does not authenticate users, so that no rule would \
         hold for them; use cert_common_names (`v2x certs init`)"
    )]
    Usernames {
        /// The id of the subject.
        subject: String,
    },
    /// A file cannot be read.
    #[error("{key}: {}: {source}", path.display())]
    Unreadable {
        /// The key of the configuration.
        key: String,
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// Anybody on this machine can read a private key.
    #[error(
        "{key}: every user of this machine can read the private key {0} (mode {mode:03o}): chmod 600 {0}",
        path.display()
    )]
    Exposed {
        /// The key of the configuration.
        key: String,
        /// The file.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
}

/// Refuses what would be ignored, finds files that are named relative to the configuration's folder, and holds private keys
/// and other secrets back from other users of the machine and from logs.
pub fn check(config: &mut Config, folder: &Path) -> Result<(), CredentialError> {
    for key in INLINE {
        if let Some(secret) = text(config, &format!("{TLS}/{key}")) {
            conceal(&secret);
        }
    }
    if let Some(password) = text(config, "transport/auth/usrpwd/password") {
        conceal(&password);
    }
    if let Some((key, what)) = UNSUPPORTED.into_iter().find(|(key, _)| text(config, key).is_some()) {
        return Err(CredentialError::Unsupported { key, what });
    }
    if let Some(subject) = subject_with_usernames(config) {
        return Err(CredentialError::Usernames { subject });
    }
    for key in KEYS.into_iter().chain(CERTIFICATES) {
        let place = format!("{TLS}/{key}");
        let Some(named) = text(config, &place) else { continue };
        let path = found(folder, Path::new(&named));
        check_file(&place, &path, KEYS.contains(&key))?;
        if let Some(path) = path.to_str().filter(|path| *path != named) {
            // A text is always a value of this key.
            let _ = config.insert_json5(&place, &format!("{path:?}"));
        }
    }
    Ok(())
}

/// A relative path is one from the folder of the configuration, or else from the working folder, as Zenoh reads it.
fn found(folder: &Path, named: &Path) -> PathBuf {
    let beside = folder.join(named);
    if named.is_relative() && !beside.exists() && named.exists() { named.to_owned() } else { beside }
}

/// From now on the secrets in these endpoints are left out of everything that is logged.
pub(in crate::net) fn conceal_endpoints(endpoints: &[String]) {
    endpoints.iter().flat_map(|endpoint| endpoint::secrets(endpoint)).for_each(conceal);
}

/// Holds back the secrets that stand in the endpoints of a configuration, and refuses files that others can read.
pub(in crate::net) fn check_endpoints(config: &Config) -> Result<(), CredentialError> {
    for part in ["listen", "connect"] {
        let endpoints = endpoint::of_config(config, part);
        conceal_endpoints(&endpoints);
        for file in endpoints.iter().flat_map(|endpoint| endpoint::private_key_files(endpoint)) {
            check_file(&format!("{part}/endpoints: private_key_file"), Path::new(file), true)?;
        }
    }
    Ok(())
}

fn check_file(key: &str, path: &Path, is_private: bool) -> Result<(), CredentialError> {
    let unreadable =
        |source| CredentialError::Unreadable { key: key.to_owned(), path: path.to_owned(), source };
    let file = std::fs::File::open(path).map_err(unreadable)?;
    if is_private {
        let mode = mode_of(&file.metadata().map_err(unreadable)?);
        if mode & 0o004 != 0 {
            return Err(CredentialError::Exposed { key: key.to_owned(), path: path.to_owned(), mode });
        }
        if mode & 0o040 != 0 {
            tracing::warn!(
                "the group of the file can read the private key {} (mode {mode:03o}): chmod 600 it unless that is meant",
                path.display()
            );
        }
    }
    Ok(())
}

#[cfg(unix)]
fn mode_of(metadata: &std::fs::Metadata) -> u32 {
    use std::os::unix::fs::PermissionsExt;
    metadata.permissions().mode() & 0o777
}

#[cfg(not(unix))]
fn mode_of(_: &std::fs::Metadata) -> u32 {
    0o600
}

/// A text of the configuration, where there is one.
fn text(config: &Config, key: &str) -> Option<String> {
    serde_json::from_str::<Option<String>>(&config.get_json(key).ok()?).ok()?
}

fn subject_with_usernames(config: &Config) -> Option<String> {
    let subjects = config.get_json("access_control/subjects").ok()?;
    let subjects: serde_json::Value = serde_json::from_str(&subjects).ok()?;
    let has_usernames = |subject: &&serde_json::Value| !subject["usernames"].is_null();
    let subject = subjects.as_array()?.iter().find(has_usernames)?;
    Some(subject["id"].as_str().unwrap_or_default().to_owned())
}

/// What a client shows, and by what it knows a hub.
#[derive(Clone, Debug, Default)]
pub(super) struct TlsFiles {
    authority: Option<PathBuf>,
    /// Certificate and private key.
    identity: Option<(PathBuf, PathBuf)>,
}

impl TlsFiles {
    /// Of a configuration that was checked.
    pub(super) fn of(config: &Config) -> Self {
        let file = |key: &str| text(config, &format!("{TLS}/{key}")).map(PathBuf::from);
        let is_mutual = config.get_json(&format!("{TLS}/enable_mtls")).is_ok_and(|value| value == "true");
        let identity = file("connect_certificate").zip(file("connect_private_key"));
        Self { authority: file("root_ca_certificate"), identity: identity.filter(|_| is_mutual) }
    }

    /// Whether the client has something to show.
    pub(super) const fn has_certificate(&self) -> bool {
        self.identity.is_some()
    }

    /// The same client as Zenoh's, with which one can ask for a reason. The error is in words.
    pub(super) fn client_config(&self) -> Result<ClientConfig, String> {
        // Zenoh's clients trust the public authorities, too.
        let mut roots = RootCertStore { roots: webpki_roots::TLS_SERVER_ROOTS.to_vec() };
        if let Some(path) = &self.authority {
            for certificate in certificates(path)? {
                roots.add(certificate).map_err(|error| format!("{}: {error}", path.display()))?;
            }
        }
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let builder =
            ClientConfig::builder_with_provider(provider).with_protocol_versions(&[&rustls::version::TLS13]);
        let builder = builder.map_err(|error| error.to_string())?.with_root_certificates(roots);
        let Some((certificate, key)) = &self.identity else { return Ok(builder.with_no_client_auth()) };
        let shown = certificates(certificate)?;
        let key_of =
            PrivateKeyDer::from_pem_file(key).map_err(|error| format!("{}: {error}", key.display()))?;
        builder
            .with_client_auth_cert(shown, key_of)
            .map_err(|error| format!("{} and {}: {error}", certificate.display(), key.display()))
    }
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, String> {
    let in_file = |error| format!("{}: {error}", path.display());
    let read = CertificateDer::pem_file_iter(path).map_err(in_file)?;
    read.collect::<Result<Vec<_>, _>>().map_err(in_file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(json5: &str) -> Config {
        Config::from_json5(json5).unwrap()
    }

    fn refused(json5: &str) -> String {
        check(&mut config(json5), Path::new(".")).unwrap_err().to_string()
    }

    #[test]
    fn a_user_name_or_password_that_zenoh_would_ignore_in_place_of_a_cert_is_refused() {
        let message =
            refused(r#"{ transport: { auth: { usrpwd: { user: "ego", password: "letmein-77" } } } }"#);
        assert!(message.contains("usrpwd/user") && message.contains("v2x certs init"), "{message}");
        assert!(!message.contains("letmein"), "{message}");
        let message = refused(r#"{ transport: { auth: { usrpwd: { dictionary_file: "users" } } } }"#);
        assert!(message.contains("dictionary_file"), "{message}");
        let message = refused(
            r#"{ access_control: { enabled: true, default_permission: "deny", rules: [], policies: [],
                 subjects: [{ id: "car", usernames: ["ego"] }] } }"#,
        );
        assert!(message.contains("\"car\"") && message.contains("cert_common_names"), "{message}");
        assert!(check(&mut config("{}"), Path::new(".")).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn a_private_tls_key_that_everybody_can_read_is_refused_and_files_are_found_beside_the_configuration() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("v2x-credentials-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let key = folder.join("key.pem");
        std::fs::write(&key, "secret").unwrap();
        let json5 = r#"{ transport: { link: { tls: { connect_private_key: "key.pem" } } } }"#;
        let check_at = |mode: u32| {
            std::fs::set_permissions(&key, std::fs::Permissions::from_mode(mode)).unwrap();
            let mut config = config(json5);
            check(&mut config, &folder).map(|()| text(&config, "transport/link/tls/connect_private_key"))
        };
        assert_eq!(check_at(0o600).unwrap(), key.to_str().map(str::to_owned));
        assert!(check_at(0o644).unwrap_err().to_string().contains("chmod 600"));
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(check_at_missing(json5, &folder).contains("key.pem"));
    }

    #[cfg(unix)]
    #[test]
    fn a_private_tls_key_that_an_endpoint_names_and_everybody_can_read_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let key = std::env::temp_dir().join(format!("v2x-endpoint-key-{}.pem", std::process::id()));
        std::fs::write(&key, "secret").unwrap();
        let check_at = |part: &str, mode: u32| {
            std::fs::set_permissions(&key, std::fs::Permissions::from_mode(mode)).unwrap();
            let endpoint = format!("tls/127.0.0.1:1#{part}_private_key_file={}", key.display());
            check_endpoints(&config(&format!("{{ {part}: {{ endpoints: [{endpoint:?}] }} }}")))
        };
        for part in ["listen", "connect"] {
            assert!(check_at(part, 0o600).is_ok());
            let refused = check_at(part, 0o644).unwrap_err().to_string();
            assert!(refused.contains("chmod 600") && refused.contains(part), "{refused}");
        }
        std::fs::remove_file(&key).unwrap();
    }

    #[cfg(unix)]
    fn check_at_missing(json5: &str, folder: &Path) -> String {
        check(&mut config(json5), folder).unwrap_err().to_string()
    }
}

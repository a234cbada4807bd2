//! The private authority: makes keys and certificates.

use super::files;
use anyhow::Context;
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer,
    KeyPair, KeyUsagePurpose,
};
use std::path::Path;
use time::OffsetDateTime;
use v2x_common::clock;

/// Its certificate, which everybody has a copy of.
pub(super) const CERTIFICATE: &str = "authority.pem";
/// Its private key: whoever has it can make certificates for anybody.
pub(super) const KEY: &str = "authority-key.pem";

/// Certificates are valid from this long before they were made, s: clocks differ.
const BACKDATED_S: i64 = 3_600;
const DAY_S: f64 = 86_400.0;

/// Makes an authority of this name in a folder; when it expires, s since the Unix epoch.
pub(super) fn make(folder: &Path, name: &str, days: f64) -> anyhow::Result<i64> {
    let expires_at = in_days(days);
    let mut params = parameters(name);
    (params.not_before, params.not_after) = validity(expires_at)?;
    let key = KeyPair::generate().context("making the key of the authority")?;
    let certificate = params.self_signed(&key).context("making the certificate of the authority")?;
    files::create(&folder.join(KEY), &key.serialize_pem())?;
    files::create(&folder.join(CERTIFICATE), &certificate.pem())?;
    Ok(expires_at)
}

/// An authority that can sign.
pub(super) struct Authority {
    issuer: Issuer<'static, KeyPair>,
    certificate: String,
    expires_at: i64,
}

/// What a certificate is for.
pub(super) enum Purpose<'a> {
    /// A hub that is reached by these addresses and DNS names.
    Hub(&'a [String]),
    /// Somebody who connects to a hub.
    Client,
}

/// A private key with its certificate, as PEM.
pub(super) struct Identity {
    pub(super) key: String,
    pub(super) certificate: String,
    /// s since the Unix epoch.
    pub(super) expires_at: i64,
}

impl Authority {
    /// Of a folder, with its name and expiry from the register.
    pub(super) fn open(folder: &Path, name: &str, expires_at: i64) -> anyhow::Result<Self> {
        let read = |file: &str| {
            let path = folder.join(file);
            std::fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))
        };
        let key =
            KeyPair::from_pem(&read(KEY)?).with_context(|| format!("in {}", folder.join(KEY).display()))?;
        Ok(Self { issuer: Issuer::new(parameters(name), key), certificate: read(CERTIFICATE)?, expires_at })
    }

    /// Its own certificate, as PEM.
    pub(super) fn certificate(&self) -> &str {
        &self.certificate
    }

    /// Makes a key and a certificate. No certificate outlives its authority.
    pub(super) fn issue(
        &self,
        common_name: &str,
        purpose: &Purpose<'_>,
        days: f64,
    ) -> anyhow::Result<Identity> {
        let expires_at = in_days(days).min(self.expires_at);
        let client = ExtendedKeyUsagePurpose::ClientAuth;
        let (hosts, usages) = match purpose {
            // It also connects to the hub that stands by for it.
            Purpose::Hub(hosts) => (hosts.to_vec(), vec![ExtendedKeyUsagePurpose::ServerAuth, client]),
            // Not for servers: an agent cannot pretend to be the hub.
            Purpose::Client => (Vec::new(), vec![client]),
        };
        let mut params = CertificateParams::new(hosts).context("the addresses of the hub (--host)")?;
        params.distinguished_name = distinguished_name(common_name);
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = usages;
        params.use_authority_key_identifier_extension = true;
        (params.not_before, params.not_after) = validity(expires_at)?;
        let key = KeyPair::generate().context("making a key")?;
        let signed = params.signed_by(&key, &self.issuer);
        let certificate = signed.with_context(|| format!("making the certificate of {common_name}"))?;
        Ok(Identity { key: key.serialize_pem(), certificate: certificate.pem(), expires_at })
    }
}

fn parameters(name: &str) -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = distinguished_name(name);
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    params
}

fn distinguished_name(common_name: &str) -> DistinguishedName {
    let mut name = DistinguishedName::new();
    name.push(DnType::CommonName, common_name);
    name
}

/// Now, s since the Unix epoch.
pub(super) fn now() -> i64 {
    clock::now().as_micros().div_euclid(1_000_000)
}

#[expect(clippy::cast_possible_truncation, reason = "days are at most a hundred years")]
fn in_days(days: f64) -> i64 {
    now() + libm::round(days * DAY_S) as i64
}

fn validity(expires_at: i64) -> anyhow::Result<(OffsetDateTime, OffsetDateTime)> {
    let at =
        |seconds| OffsetDateTime::from_unix_timestamp(seconds).context("the date of expiry is out of range");
    // In order where it expires at once, too.
    Ok((at((now() - BACKDATED_S).min(expires_at))?, at(expires_at)?))
}

/// A day as people write it, of s since the Unix epoch.
pub(super) fn day(seconds: i64) -> String {
    OffsetDateTime::from_unix_timestamp(seconds)
        .map_or_else(|_| seconds.to_string(), |at| at.date().to_string())
}

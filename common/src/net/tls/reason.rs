//! Why a TLS handshake was refused, in words.

use rustls::{AlertDescription, CertificateError, Error, InvalidMessage};

/// Why a client is not let in, or does not go in itself.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TlsRefusal {
    /// The hub wants a certificate, and the client has none.
    #[error(
        "it asks for a certificate and this program has none: give --zenoh-config with the file that `v2x certs agent` or \
         `v2x certs viewer` has written"
    )]
    NoCertificate,
    /// The client does not know the authority of the hub's certificate.
    #[error(
        "its certificate is from an authority that this program does not know: root_ca_certificate is to be the \
         authority.pem of the same `v2x certs init`"
    )]
    UnknownHubAuthority,
    /// The hub does not know the authority of the client's certificate.
    #[error(
        "it does not know the authority of this program's certificate: have one made where the hub's was (`v2x certs`)"
    )]
    UnknownClientAuthority,
    /// The hub's certificate is for other addresses.
    #[error(
        "its certificate is not for the address {0:?}: connect to one that it is for, or make it again with \
         `v2x certs hub NAME --host {0}`"
    )]
    OtherName(String),
    /// The hub's certificate is too old, or not valid yet.
    #[error(
        "its certificate has expired or is not valid yet: make it again with `v2x certs hub`, and check both clocks"
    )]
    HubExpired,
    /// The client's certificate is too old, or not valid yet.
    #[error(
        "this program's certificate has expired or is not valid yet: make it again with `v2x certs agent` or `v2x certs \
         viewer`, and check both clocks"
    )]
    ClientExpired,
    /// The hub's certificate is no hub's.
    #[error("its certificate is not one of a hub: somebody else listens there")]
    NoHub,
    /// The client's certificate is not accepted for another cause.
    #[error("it refuses this program's certificate ({0})")]
    BadClientCertificate(String),
    /// There is no TLS at the endpoint.
    #[error(
        "it does not answer in TLS: connect by tcp/, or start the hub with the configuration that `v2x certs init` has written"
    )]
    NoTls,
    /// There is TLS at an endpoint that is to be plain TCP.
    #[error(
        "it speaks TLS: connect by tls/, and give --zenoh-config with the file that `v2x certs` has written"
    )]
    Tls,
    /// The client's own files cannot be used.
    #[error("{0}")]
    OwnFiles(String),
    /// Anything else, in the words of the library.
    #[error("the TLS handshake failed: {0}")]
    Other(String),
}

impl TlsRefusal {
    /// Why the handshake of a client with a host ended; `has_certificate` is whether the client had one to show.
    pub(super) fn of(error: &Error, host: &str, has_certificate: bool) -> Self {
        match error {
            Error::InvalidCertificate(error) => Self::of_hub_certificate(error, host),
            Error::AlertReceived(alert) => Self::of_alert(*alert, has_certificate),
            Error::InvalidMessage(InvalidMessage::InvalidContentType) => Self::NoTls,
            other => Self::Other(other.to_string()),
        }
    }

    fn of_hub_certificate(error: &CertificateError, host: &str) -> Self {
        match error {
            CertificateError::UnknownIssuer | CertificateError::BadSignature => Self::UnknownHubAuthority,
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. } => {
                Self::OtherName(host.to_owned())
            }
            CertificateError::Expired
            | CertificateError::ExpiredContext { .. }
            | CertificateError::NotValidYet
            | CertificateError::NotValidYetContext { .. } => Self::HubExpired,
            CertificateError::InvalidPurpose | CertificateError::InvalidPurposeContext { .. } => Self::NoHub,
            other => Self::Other(other.to_string()),
        }
    }

    fn of_alert(alert: AlertDescription, has_certificate: bool) -> Self {
        match alert {
            AlertDescription::CertificateRequired => Self::NoCertificate,
            _ if !has_certificate => Self::Other(format!("{alert:?}")),
            AlertDescription::UnknownCA | AlertDescription::DecryptError => Self::UnknownClientAuthority,
            AlertDescription::CertificateExpired => Self::ClientExpired,
            other => Self::BadClientCertificate(format!("{other:?}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_tls_refusal_names_its_cause_and_what_to_do() {
        let of = |error: Error| TlsRefusal::of(&error, "10.0.0.1", true);
        let alert = |alert| of(Error::AlertReceived(alert));
        let certificate = |error| of(Error::InvalidCertificate(error));
        assert_eq!(alert(AlertDescription::CertificateRequired), TlsRefusal::NoCertificate);
        assert_eq!(alert(AlertDescription::UnknownCA), TlsRefusal::UnknownClientAuthority);
        assert_eq!(alert(AlertDescription::CertificateExpired), TlsRefusal::ClientExpired);
        assert_eq!(certificate(CertificateError::UnknownIssuer), TlsRefusal::UnknownHubAuthority);
        assert_eq!(certificate(CertificateError::Expired), TlsRefusal::HubExpired);
        assert_eq!(certificate(CertificateError::InvalidPurpose), TlsRefusal::NoHub);
        let other_name = certificate(CertificateError::NotValidForName).to_string();
        assert!(other_name.contains("--host 10.0.0.1"), "{other_name}");
        assert_eq!(of(InvalidMessage::InvalidContentType.into()), TlsRefusal::NoTls);
    }
}

//! TLS, as far as Zenoh leaves it to us: settings that it would ignore, secrets, and why a handshake is refused.

mod believed;
mod credentials;
mod probe;
mod reason;
mod secrets;
mod unreadable;

pub(super) use believed::why_not_believed;
pub use credentials::{CredentialError, check};
pub(super) use credentials::{check_endpoints, conceal_endpoints};
pub use probe::why_not_connected;
pub use reason::TlsRefusal;
pub(super) use secrets::{redacted, without_secrets};
pub(super) use unreadable::without_values;

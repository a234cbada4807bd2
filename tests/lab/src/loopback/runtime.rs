//! The runtime that Zenoh needs.

use crate::loopback::KitError;
use tokio::runtime::{Handle, RuntimeFlavor};

/// Checks that Zenoh works in this runtime: with one thread, its callbacks and our tasks block each other.
pub(super) fn check() -> Result<(), KitError> {
    let runtime = Handle::try_current().map_err(|_| KitError::NoRuntime)?;
    match runtime.runtime_flavor() {
        RuntimeFlavor::CurrentThread => Err(KitError::OneThread),
        _ => Ok(()),
    }
}

/// Runs a future to its end, for tests without a runtime.
pub fn block_on<T, E: From<KitError>>(test: impl Future<Output = Result<T, E>>) -> Result<T, E> {
    if Handle::try_current().is_ok() {
        return Err(KitError::RuntimeInRuntime.into());
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    runtime.map_err(KitError::Runtime)?.block_on(test)
}

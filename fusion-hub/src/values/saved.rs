//! States that are saved and put back, for recordings that can be computed again.
//!
//! Most types of the core derive serde's traits. A value that is made from settings and holds buffers implements [`Saved`]:
//! its state is put into a new value of the same settings. The bytes are postcard; they hold for one build only.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Why a state cannot be saved or put back.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// The method of fusion does not say what its state is.
    #[error("this fusion method does not save its state")]
    NotSaved,
    /// It does not have the layout that this build writes.
    #[error("the saved state is broken, or another build wrote it: {0}")]
    Layout(#[from] postcard::Error),
    /// More bytes than this build would write.
    #[error("the saved state is broken, or another build wrote it: {0} bytes are left over")]
    LeftOver(usize),
}

/// A value whose state can be put into a new one of the same settings.
pub trait Saved {
    /// Appends the state.
    ///
    /// # Errors
    /// Where there is no memory for it.
    fn save(&self, out: &mut Vec<u8>) -> Result<(), StateError>;

    /// Takes the state from the front of the bytes.
    ///
    /// # Errors
    /// Where they are no such state. Then this value is of no use any more.
    fn load(&mut self, bytes: &mut &[u8]) -> Result<(), StateError>;
}

impl<T: Serialize + DeserializeOwned> Saved for T {
    fn save(&self, out: &mut Vec<u8>) -> Result<(), StateError> {
        *out = postcard::to_extend(self, std::mem::take(out))?;
        Ok(())
    }

    fn load(&mut self, bytes: &mut &[u8]) -> Result<(), StateError> {
        (*self, *bytes) = postcard::take_from_bytes(bytes)?;
        Ok(())
    }
}

/// Implements [`Saved`] for a struct: by the fields that are its state, and those that are made anew. Each field is in one of
/// the two lists, or it does not compile.
macro_rules! saved {
    ([$($generics:tt)*] $type:ty, saved { $($saved:ident),* }, made_anew { $($anew:ident),* }) => {
        impl<$($generics)*> $crate::values::Saved for $type {
            fn save(&self, out: &mut Vec<u8>) -> Result<(), $crate::values::StateError> {
                let Self { $($saved,)* $($anew: _,)* } = self;
                $($crate::values::Saved::save($saved, out)?;)*
                Ok(())
            }

            fn load(&mut self, bytes: &mut &[u8]) -> Result<(), $crate::values::StateError> {
                let Self { $($saved,)* $($anew: _,)* } = self;
                $($crate::values::Saved::load($saved, bytes)?;)*
                Ok(())
            }
        }
    };
}
pub(crate) use saved;

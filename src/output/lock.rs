//! Locks on files, so that a folder has one writer, or some that know of each other.

use crate::error::{Error, FolderError, Result};
use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::Path;

/// Who may hold the lock of a folder beside its holder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// Nobody.
    Nobody,
    /// Others that say the same: they write different files.
    Others,
}

/// Opens the file `name` of `folder`, and makes it if there is none, with its lock as long as it is open.
///
/// # Errors
/// [`Error::Folder`] if somebody holds it who lets nobody, or not this one, stand beside; [`Error::Io`].
pub fn hold(folder: &Path, name: &str, beside: Beside) -> Result<File> {
    let path = folder.join(name);
    let opened = File::options().read(true).write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(Error::io(&path))?;
    let locked = match beside {
        Beside::Nobody => file.try_lock(),
        Beside::Others => file.try_lock_shared(),
    };
    match locked {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(FolderError::InUse(folder.to_path_buf()).into()),
        // Some network file systems have no locks; then it is the user who keeps writers apart.
        Err(TryLockError::Error(e)) if matches!(e.kind(), ErrorKind::Unsupported) => Ok(file),
        Err(TryLockError::Error(e)) => Err(Error::io(&path)(e)),
    }
}

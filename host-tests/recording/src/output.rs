//! Output of a command on disk: whole, or not at all.
//!
//! Files are written into a hidden sibling of their destination and moved there by renaming once all are complete. A
//! command that fails leaves the destination unchanged, and so does one that is terminated and calls [`abandon`].
//!
//! Out of scope: flushing to the medium (a power cut may lose the last files, as with any command), and one atomic step
//! if the destination folder exists already; then each file is replaced whole, in the order of its addition.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile, TempDir};

use crate::error::InputError;

/// Paths of unfinished outputs. Creating, moving or removing one requires the lock.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Locks the list, also after a panic in another thread: it is consistent between any two steps.
fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every unfinished output, for a terminating process.
///
/// # Returns
/// A guard; while it is held no output is started or moved to its place. Hold it until the process ends.
#[must_use = "without it other threads go on writing"]
pub fn abandon() -> impl Drop {
    let mut paths = unfinished();
    for path in paths.drain(..) {
        // A failed removal is ignored: the process ends in any case.
        let _ = match path.is_dir() {
            true => fs::remove_dir_all(&path),
            false => fs::remove_file(&path),
        };
    }
    paths
}

/// Path on the list, for the lifetime of this value.
#[derive(Debug)]
struct Unfinished(PathBuf);

impl Unfinished {
    /// Creates a temporary file or folder and lists its path, in one step.
    fn make<T>(
        make: impl FnOnce() -> io::Result<T>,
        path: impl Fn(&T) -> &Path,
    ) -> io::Result<(T, Self)> {
        let mut paths = unfinished();
        let made = make()?;
        let path = path(&made).to_path_buf();
        paths.push(path.clone());
        Ok((made, Self(path)))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

/// Folder for intermediate files: removed with this value, or by [`abandon`].
#[derive(Debug)]
pub struct ScratchFolder {
    folder: TempDir,
    // Dropped after the folder.
    _unfinished: Unfinished,
}

impl ScratchFolder {
    /// Creates an empty folder in the system's temporary folder.
    pub fn new() -> Result<Self, InputError> {
        let made = Unfinished::make(tempfile::tempdir, TempDir::path);
        let (folder, unfinished) = made.map_err(|error| {
            InputError::new(std::env::temp_dir(), format!("cannot hold files ({error})"))
        })?;
        Ok(Self {
            folder,
            _unfinished: unfinished,
        })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Folder of results in preparation.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    staging: TempDir,
    // Dropped after the folder.
    _unfinished: Unfinished,
    names: Vec<PathBuf>,
    /// Files of earlier runs to be removed.
    without: Vec<String>,
}

impl OutputFolder {
    /// Prepares to fill `target`. Fails at once, before any work, if it cannot be written.
    pub fn create(target: impl AsRef<Path>) -> Result<Self, InputError> {
        let target = target.as_ref().to_path_buf();
        if target.as_os_str().is_empty() {
            return Err(InputError::new(&target, "is not the name of a folder")
                .expected("a folder to write to"));
        }
        if target.exists() && !target.is_dir() {
            return Err(InputError::new(&target, "is a file").expected("a folder to write to"));
        }
        // An existing folder is tested itself, because its parent may be writable even if it is not.
        let beside = if target.is_dir() {
            target.clone()
        } else {
            nearest_folder(&target)
        };
        let (staging, unfinished) =
            Unfinished::make(|| builder(0o777).tempdir_in(&beside), TempDir::path)
                .map_err(|error| InputError::unwritable(&target, &error))?;
        Ok(Self {
            target,
            staging,
            _unfinished: unfinished,
            names: Vec::new(),
            without: Vec::new(),
        })
    }

    /// Destination folder of the results.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Adds the file `name` with this content.
    pub fn write(&mut self, name: impl AsRef<Path>, bytes: &[u8]) -> Result<(), InputError> {
        let name = name.as_ref();
        let mut file = self.file(name)?;
        file.write_all(bytes)
            .map_err(|error| InputError::unwritable(self.target.join(name), &error))
    }

    /// Adds the file `name`, open for writing.
    pub fn file(&mut self, name: impl AsRef<Path>) -> Result<File, InputError> {
        let name = name.as_ref();
        let path = self.staging.path().join(name);
        let _held = unfinished();
        let opened = match path.parent() {
            Some(parent) => fs::create_dir_all(parent).and_then(|()| File::create(&path)),
            None => File::create(&path),
        };
        let file =
            opened.map_err(|error| InputError::unwritable(self.target.join(name), &error))?;
        if !self.names.iter().any(|known| known == name) {
            self.names.push(name.to_path_buf());
        }
        Ok(file)
    }

    /// Removes a file of an earlier run when the others are moved to their place.
    pub fn without(&mut self, name: &str) {
        self.without.push(name.to_owned());
    }

    /// Moves all files to their place.
    pub fn commit(self) -> Result<(), InputError> {
        let held = unfinished();
        let moved = if self.target.is_dir() {
            self.replace_files()
        } else {
            self.move_folder()
        };
        drop(held);
        moved.map_err(|error| InputError::unwritable(&self.target, &error))
    }

    fn move_folder(&self) -> io::Result<()> {
        if let Some(parent) = self.target.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::rename(self.staging.path(), &self.target)
    }

    fn replace_files(&self) -> io::Result<()> {
        for name in &self.without {
            match fs::remove_file(self.target.join(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        for name in &self.names {
            let place = self.target.join(name);
            if place.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            if let Some(parent) = place.parent() {
                fs::create_dir_all(parent)?;
            }
        }
        let mut names = self.names.iter();
        names
            .try_for_each(|name| fs::rename(self.staging.path().join(name), self.target.join(name)))
    }
}

/// Writes one file whole or not at all.
pub fn write_file(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), InputError> {
    OutputFile::create(path, bytes)?.commit()
}

/// Single file, complete but not yet in its place: for a command that also writes a folder.
#[derive(Debug)]
pub struct OutputFile {
    target: PathBuf,
    staged: NamedTempFile,
    unfinished: Unfinished,
}

impl OutputFile {
    /// Writes the content near `target`. Fails if `target` cannot be written.
    pub fn create(target: impl AsRef<Path>, bytes: &[u8]) -> Result<Self, InputError> {
        let target = target.as_ref().to_path_buf();
        if target.is_dir() {
            return Err(InputError::new(&target, "is a folder").expected("a file to write"));
        }
        let folder = nearest_folder(&target);
        let make = || builder(0o666).tempfile_in(&folder);
        Unfinished::make(make, NamedTempFile::path)
            .and_then(|(mut staged, unfinished)| {
                staged.write_all(bytes)?;
                Ok(Self {
                    target: target.clone(),
                    staged,
                    unfinished,
                })
            })
            .map_err(|error| InputError::unwritable(&target, &error))
    }

    /// Moves the file to its place, in a folder that must exist by now.
    pub fn commit(self) -> Result<(), InputError> {
        let Self {
            target,
            staged,
            unfinished: listed,
        } = self;
        let held = unfinished();
        let moved = staged.persist(&target);
        drop(held);
        drop(listed);
        match moved {
            Ok(_) => Ok(()),
            Err(error) => Err(InputError::unwritable(&target, &error.error)),
        }
    }
}

/// Builder of hidden temporary names with the permissions of an ordinary file or folder.
fn builder(mode: u32) -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(".rlg-").suffix(".partial");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

/// Returns the nearest existing folder above `path`: on the same file system as a file created under it.
fn nearest_folder(path: &Path) -> PathBuf {
    let above = path
        .ancestors()
        .skip(1)
        .find(|above| above.exists() && !above.as_os_str().is_empty());
    above.map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

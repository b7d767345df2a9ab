//! Reads a file once from front to back and computes its SHA-256, in hexadecimal.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use indicatif::ProgressBar;
use sha2::{Digest as _, Sha256};

use crate::error::InputError;

/// Reader that computes the hash of the bytes read.
pub struct Hashed {
    file: File,
    hash: Sha256,
    bar: ProgressBar,
}

impl Hashed {
    /// Opens `path` and returns its length in bytes, too. `bar` moves with the bytes.
    pub fn open(path: &Path, bar: &ProgressBar) -> Result<(BufReader<Self>, u64), InputError> {
        let file = File::open(path).map_err(|error| InputError::unreadable(path, &error))?;
        let about = file
            .metadata()
            .map_err(|error| InputError::unreadable(path, &error))?;
        if !about.is_file() {
            return Err(InputError::new(path, "is not a file").expected("a recording by others"));
        }
        bar.set_length(about.len());
        let hashed = Self {
            file,
            hash: Sha256::new(),
            bar: bar.clone(),
        };
        Ok((BufReader::new(hashed), about.len()))
    }

    /// Returns the SHA-256 of all bytes read, in hexadecimal.
    pub fn sum(self) -> String {
        let bytes = self.hash.finalize();
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl Read for Hashed {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(into)?;
        self.hash.update(&into[..count]);
        self.bar.inc(count as u64);
        Ok(count)
    }
}

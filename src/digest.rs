//! The contents of a recording as a number that no other contents have: SHA-256 (FIPS 180-4).

use std::fs::File;
use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::video::stills_in;

/// The digest in hexadecimal, and the length in bytes, of a file; of a folder of stills that of the stills, one after the other in order.
///
/// # Errors
/// [`Error::Unreadable`], [`Error::NoStills`].
pub fn of_recording(path: &Path) -> Result<(String, u64)> {
    let files = if path.is_dir() { stills_in(path)? } else { vec![path.to_owned()] };
    let mut digest = Sha256::new();
    let mut bytes = 0;
    for file in &files {
        bytes += add(file, &mut digest)?;
    }
    Ok((hexadecimal(&digest.finalize()), bytes))
}

/// The digest of some bytes.
pub fn of_bytes(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// Adds a file; its length.
fn add(path: &Path, digest: &mut Sha256) -> Result<u64> {
    let failed = |e| Error::unreadable(path, e);
    let mut file = File::open(path).map_err(failed)?;
    let mut buffer = vec![0u8; 1 << 20];
    let mut bytes = 0;
    loop {
        let n = file.read(&mut buffer).map_err(failed)?;
        if n == 0 {
            return Ok(bytes);
        }
        bytes += n as u64;
        digest.update(&buffer[..n]);
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_standard_s_own_example() {
        assert_eq!(super::of_bytes(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}

//! Commitments: BLAKE3 over salt and answer, and a Merkle root over all of them.
//!
//! `commitment = BLAKE3(salt ‖ bytes)`, salt 32 bytes of the operating system's random source, one a record.
//! `leaf = BLAKE3(0x00 ‖ text)`, `node = BLAKE3(0x01 ‖ left ‖ right)`; an odd node is carried up unchanged. The
//! leading byte keeps a leaf from passing for a node.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{TrialError, at};

/// 32 bytes that make a commitment unguessable.
pub type Salt = [u8; 32];

/// Commitment of `bytes`, hexadecimal.
pub fn commit(salt: &Salt, bytes: &[u8]) -> String {
    blake3::Hasher::new().update(salt).update(bytes).finalize().to_hex().to_string()
}

/// Plain hash of `bytes`, hexadecimal.
pub fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Hash of a file, hexadecimal.
///
/// # Errors
/// [`TrialError::File`] where it cannot be read.
pub fn hash_file(path: &Path) -> Result<String, TrialError> {
    let mut hasher = blake3::Hasher::new();
    let mut file = File::open(path).map_err(at(path))?;
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block).map_err(at(path))? {
            0 => return Ok(hasher.finalize().to_hex().to_string()),
            n => hasher.update(&block[..n]),
        };
    }
}

/// Merkle root of the leaves in their order, hexadecimal. No leaf: the hash of nothing.
pub fn root<T: AsRef<[u8]>>(leaves: &[T]) -> String {
    let mut level: Vec<blake3::Hash> =
        leaves.iter().map(|text| blake3::Hasher::new().update(&[0]).update(text.as_ref()).finalize()).collect();
    while level.len() > 1 {
        level = level
            .chunks(2)
            .map(|pair| match pair {
                [left, right] => {
                    blake3::Hasher::new().update(&[1]).update(left.as_bytes()).update(right.as_bytes()).finalize()
                }
                _ => pair[0],
            })
            .collect();
    }
    level.first().map_or_else(|| hash(&[]), |root| root.to_hex().to_string())
}

/// Salt of a record: from the operating system, or from a seed where a test must repeat itself.
///
/// # Errors
/// [`TrialError::File`] where the system has no random source at `/dev/urandom`.
pub fn salt(seed: Option<u64>, record: &str) -> Result<Salt, TrialError> {
    if let Some(seed) = seed {
        return Ok(*blake3::hash(format!("salt {seed} {record}").as_bytes()).as_bytes());
    }
    let (source, mut salt) = (Path::new("/dev/urandom"), [0; 32]);
    File::open(source).and_then(|mut file| file.read_exact(&mut salt)).map_err(at(source))?;
    Ok(salt)
}

/// Lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bytes of 64 hexadecimal digits; `None` for anything else.
pub fn salt_of(text: &str) -> Option<Salt> {
    let mut salt = [0; 32];
    if text.len() != 64 || !text.is_ascii() {
        return None;
    }
    for (byte, n) in salt.iter_mut().zip((0..64).step_by(2)) {
        *byte = u8::from_str_radix(text.get(n..n + 2)?, 16).ok()?;
    }
    Some(salt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_leaf_and_their_order_matter() {
        let base = root(&["a", "b", "c"]);
        for other in [vec!["a", "b"], vec!["a", "c", "b"], vec!["a", "b", "d"], vec!["a", "b", "c", "c"]] {
            assert_ne!(base, root(&other));
        }
    }

    #[test]
    fn the_salt_hides_the_answer() {
        let (one, other) = (salt(Some(1), "r1").unwrap(), salt(Some(1), "r2").unwrap());
        assert_ne!(commit(&one, b"nothing"), commit(&other, b"nothing"));
        assert_eq!(salt_of(&hex(&one)), Some(one));
        assert_eq!(salt_of("zz"), None);
        assert_ne!(salt(None, "r1").unwrap(), salt(None, "r1").unwrap());
    }
}

//! CRC-32/ISO-HDLC, that of Ethernet and zip, for data longer than a frame.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};

/// Without a table: 1 KiB of flash is too much for something seldom done.
static CRC32: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// The CRC of all bytes; that of an image is what [`service`](crate::service) asks for.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC32.checksum(bytes)
}

/// CRC of data that comes in parts: `so_far` is that of the parts before.
#[inline(never)]
pub(crate) fn running(so_far: Option<u32>, bytes: &[u8]) -> u32 {
    let mut digest: Digest<'_, u32, NoTable> = match so_far {
        None => CRC32.digest(),
        // the catalogue's final XOR undone; it reflects in and out, so the register goes in reversed
        Some(crc) => CRC32.digest_with_initial((!crc).reverse_bits()),
    };
    digest.update(bytes);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crc_may_grow_in_any_steps() {
        let bytes: std::vec::Vec<u8> = (0..100_u8).map(|n| n.wrapping_mul(37)).collect();
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
        for cut in 0..bytes.len() {
            let first = running(None, &bytes[..cut]);
            assert_eq!(running(Some(first), &bytes[cut..]), crc32(&bytes), "{cut}");
        }
    }
}

//! CRC-32 as PNG, zip and Ethernet have it.

/// The reflected polynomial of ISO 3309.
const POLYNOMIAL: u32 = 0xEDB8_8320;

/// The remainders of all single bytes: 1 KiB of flash for eight times fewer steps.
static REMAINDERS: [u32; 256] = remainders();

#[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "evaluated by the compiler only")]
const fn remainders() -> [u32; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ POLYNOMIAL } else { crc >> 1 };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// Returns the CRC-32 of `bytes`.
///
/// # Budget
/// About 8 instructions a byte.
///
/// ```
/// assert_eq!(pocketsplat_format::bundle::crc32(b"123456789"), 0xCBF4_3926);
/// ```
// Not inlined: it has many callers.
#[inline(never)]
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    crc32_of(bytes.iter().copied())
}

/// The same of bytes that lie nowhere.
#[inline]
pub(crate) fn crc32_of(bytes: impl Iterator<Item = u8>) -> u32 {
    !bytes.fold(!0, |crc, byte| {
        let [low, ..] = crc.to_le_bytes();
        let remainder = REMAINDERS.get(usize::from(low ^ byte)).copied().unwrap_or(0);
        (crc >> 8) ^ remainder
    })
}

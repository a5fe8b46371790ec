//! Count of starts since the supply was switched on, kept in memory that no reset clears.

use core::mem::MaybeUninit;

use can_wire::ResetCause;

/// First word of a record; any other is memory content after power-on.
const MAGIC: u32 = 0x424F_4F54;

/// Magic, count, complement of the count.
#[unsafe(link_section = ".uninit.boots")]
static mut RECORD: MaybeUninit<[u32; 3]> = MaybeUninit::uninit();

/// Counts this start and returns its number, 1 after power-on; stops at 65535.
pub(super) fn count(cause: ResetCause) -> u16 {
    let record = &raw mut RECORD;
    // SAFETY: called once, before interrupts and tasks exist, so nobody else reads or writes the record. Any bit
    // pattern in memory is a valid u32, and the check below detects noise.
    let [magic, count, complement] = unsafe { record.cast::<[u32; 3]>().read_volatile() };
    let intact = magic == MAGIC && complement == !count && cause != ResetCause::PowerOn;
    let count = if intact { count.saturating_add(1) } else { 1 };
    // SAFETY: as above.
    unsafe { record.cast::<[u32; 3]>().write_volatile([MAGIC, count, !count]) };
    u16::try_from(count).unwrap_or(u16::MAX)
}

//! RCC: oscillators, PLL and dividers as far as they clock a model, and the reset flags.
//!
//! Oscillators and the PLL are ready as soon as they are on. Peripheral clock enables and resets are
//! stored: a peripheral answers whether or not its clock is on, and keeps its state through its
//! reset bit. Source: RM0440 chapter 7.

use rigless::device::{Device, DeviceContext, RegisterFile, ResetCause};

use super::word::Word;

/// The instance, as clock wires name it.
pub(crate) const INSTANCE: &str = "RCC";
/// The clocks driven, by output number.
pub(crate) const TIMER_CLOCK: usize = 0;
pub(crate) const CONVERTER_CLOCK: usize = 1;
pub(crate) const CAN_CLOCK: usize = 2;
pub(crate) const HCLK: usize = 3;
const OUTPUTS: usize = 4;

const HSI_HZ: u64 = 16_000_000;
/// The crystal on the board.
pub(super) const HSE_HZ: u64 = 24_000_000;

/// What every output runs at out of reset: the buses on the HSI, the converter on nothing, CAN on
/// the crystal.
const RESET_RATES: [u64; OUTPUTS] = [HSI_HZ, 0, HSE_HZ, HSI_HZ];

const CR: Word = Word(0x00);
const CFGR: Word = Word(0x08);
const PLLCFGR: Word = Word(0x0C);
const CCIPR: Word = Word(0x88);
const BDCR: Word = Word(0x90);
pub(crate) const CSR: Word = Word(0x94);
const CRRCR: Word = Word(0x98);

/// `OBLRSTF` to `LPWRRSTF`.
const RESET_FLAGS: u64 = 0xFE00_0000;
const RMVF: u64 = 1 << 23;
const PINRSTF: u64 = 1 << 26;
const BORRSTF: u64 = 1 << 27;
const SFTRSTF: u64 = 1 << 28;
const IWDGRSTF: u64 = 1 << 29;

/// The clock controller.
#[derive(Debug)]
pub(crate) struct Clocks {
    driven: [u64; OUTPUTS],
    flags: u64,
}

impl Clocks {
    /// Out of a power-on reset.
    pub(crate) fn new() -> Self {
        // RM0440 7.4.30: the power-on value names the brown-out and the pin.
        Self { driven: RESET_RATES, flags: BORRSTF | PINRSTF }
    }

    /// Registers that are not zero after a reset.
    pub(crate) fn set_reset_values(registers: &mut RegisterFile) {
        registers.set(CR, 0x500);
        registers.set(CFGR, 0x5);
        registers.set(PLLCFGR, 0x1000);
    }

    /// A restart adds its own flag to those the firmware has not cleared, and drives the pin.
    pub(crate) fn note(&mut self, cause: ResetCause) {
        self.flags |= PINRSTF
            | match cause {
                ResetCause::Core => SFTRSTF,
                ResetCause::Model(_) => IWDGRSTF,
                ResetCause::PowerOn => BORRSTF,
                _ => 0,
            };
    }

    fn drive(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        for (output, hz) in rates(registers).into_iter().enumerate() {
            if self.driven[output] != hz {
                self.driven[output] = hz;
                context.clock(output, hz);
            }
        }
    }
}

/// What every output runs at as the registers stand.
fn rates(registers: &RegisterFile) -> [u64; OUTPUTS] {
    let field = |word: Word, shift: u32, mask: u64| registers.get(word) >> shift & mask;
    let source = match field(PLLCFGR, 0, 3) {
        2 => HSI_HZ,
        3 => HSE_HZ,
        _ => 0,
    };
    let vco = source / (field(PLLCFGR, 4, 0xF) + 1) * field(PLLCFGR, 8, 0x7F);
    let tap = |shift| vco / (2 * (field(PLLCFGR, shift, 3) + 1));
    let pll_p = match field(PLLCFGR, 27, 0x1F) {
        0 => vco / if field(PLLCFGR, 17, 1) == 1 { 17 } else { 7 },
        divider => vco / divider,
    };
    let system = match field(CFGR, 0, 3) {
        2 => HSE_HZ,
        3 => tap(25),
        _ => HSI_HZ,
    };
    let ahb = match field(CFGR, 4, 0xF) {
        code @ 0x8..=0xB => system >> (code - 7),
        code @ 0xC..=0xF => system >> (code - 6),
        _ => system,
    };
    let apb1_shift = field(CFGR, 8, 7).saturating_sub(3);
    let apb1 = ahb >> apb1_shift;
    // RM0440 7.2.17: twice the bus where the bus is divided.
    let timers = if apb1_shift == 0 { apb1 } else { 2 * apb1 };
    let converter = match field(CCIPR, 28, 3) {
        1 => pll_p,
        2 => system,
        _ => 0,
    };
    let can = match field(CCIPR, 24, 3) {
        0 => HSE_HZ,
        1 => tap(21),
        2 => apb1,
        _ => 0,
    };
    let mut rates = [0; OUTPUTS];
    rates[TIMER_CLOCK] = timers;
    rates[CONVERTER_CLOCK] = converter;
    rates[CAN_CLOCK] = can;
    rates[HCLK] = ahb;
    rates
}

impl Device for Clocks {
    type Register = Word;

    fn read(&mut self, register: Word, registers: &mut RegisterFile, _: &mut DeviceContext<'_>) -> Option<u64> {
        let value = registers.get(register);
        Some(match register {
            // HSIRDY follows HSION, HSERDY HSEON, PLLRDY PLLON.
            CR => value & !0x0202_0400 | (value & 0x100) << 2 | (value & 0x0101_0000) << 1,
            // SWS follows SW.
            CFGR => value & !0xC | (value & 3) << 2,
            // LSERDY follows LSEON, HSI48RDY HSI48ON.
            BDCR | CRRCR => value & !2 | (value & 1) << 1,
            // LSIRDY follows LSION.
            CSR => value & !(RESET_FLAGS | RMVF | 2) | (value & 1) << 1 | self.flags,
            _ => return None,
        })
    }

    fn write(&mut self, register: Word, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if register == CSR && value & RMVF != 0 {
            self.flags = 0;
        }
        if [CR, CFGR, PLLCFGR, CCIPR].contains(&register) {
            self.drive(registers, context);
        }
    }

    fn reset(&mut self) {
        self.driven = RESET_RATES;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The part's bus, for the register file of the clock controller.
    fn bus() -> rigless::soc::Bus {
        let mut bus = crate::g474::describe().expect("a description rigless takes");
        Clocks::set_reset_values(registers(&mut bus));
        bus
    }

    fn registers(bus: &mut rigless::soc::Bus) -> &mut RegisterFile {
        let slot = bus.slot(INSTANCE).expect("the part has one");
        bus.slot_mut(slot).registers_mut()
    }

    #[test]
    fn out_of_reset_the_tree_runs_as_the_models_assume() {
        assert_eq!(rates(registers(&mut bus())), RESET_RATES);
    }

    #[test]
    fn the_boards_settings_give_the_boards_clocks() {
        let mut bus = bus();
        let registers = registers(&mut bus);
        // HSE / 6 * 80 = 320 MHz; Q / 4, R / 2; SYSCLK from the PLL; FDCAN from Q, ADC from SYSCLK.
        registers.set(PLLCFGR, 3 | 5 << 4 | 80 << 8 | 1 << 21);
        registers.set(CFGR, 3);
        registers.set(CCIPR, 2 << 28 | 1 << 24);
        let mut expected = [0; OUTPUTS];
        expected[TIMER_CLOCK] = 160_000_000;
        expected[CONVERTER_CLOCK] = 160_000_000;
        expected[CAN_CLOCK] = 80_000_000;
        expected[HCLK] = 160_000_000;
        assert_eq!(rates(registers), expected);
        // APB1 by four: its timers at twice the bus.
        registers.set(CFGR, 3 | 0b101 << 8);
        assert_eq!(rates(registers)[TIMER_CLOCK], 80_000_000);
    }
}

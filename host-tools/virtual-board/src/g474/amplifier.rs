//! SYSCFG's block, of which OPAMP1 matters: the force amplifier between PA1 and the converter.

use rigless::device::{Device, DeviceContext, Level, RegisterFile};

use super::word::Word;

/// The instance, as requests name it.
pub(crate) const INSTANCE: &str = "SYSCFG";
/// The line that is high while OPAMP1's output reaches the converter.
pub(crate) const CONNECTED: usize = 0;

const OPAMP1_CSR: Word = Word(0x300);
const OPAEN: u64 = 1;
const VM_SEL_MASK: u64 = 0b11 << 5;
/// `VM_SEL` of the programmable gain, RM0440 25.5.1.
const VM_SEL_PGA: u64 = 0b10 << 5;
const OPAINTOEN: u64 = 1 << 8;

/// OPAMP1 as a switch: the bench sets codes at the converter, so the gain does not matter here.
#[derive(Debug, Default)]
pub(crate) struct Amplifier {
    connected: Level,
}

impl Device for Amplifier {
    type Register = Word;

    fn write(&mut self, _: Word, _: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let control = registers.get(OPAMP1_CSR);
        let wanted = OPAEN | OPAINTOEN | VM_SEL_PGA;
        let connected = Level::from(control & (OPAEN | OPAINTOEN | VM_SEL_MASK) == wanted);
        if connected != self.connected {
            self.connected = connected;
            context.request(CONNECTED, connected);
        }
    }

    fn reset(&mut self) {
        self.connected = Level::Low;
    }
}

//! DMA2, whose stream 0 empties the converter: rigless' controller behind a bus that can be late.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32f427::generated::dma2::Register;
use rigless::soc::stm32f427::peripherals::CONTROLLERS;
use rigless::soc::stm32f427::peripherals::adc::DMA_REQUEST;
use rigless::soc::stm32f427::peripherals::dma::Dma;

/// DMA2, with a way to be late once.
#[derive(Debug)]
pub(crate) struct ConverterDma {
    dma: Dma,
    /// The next request of ADC1 goes unheard, so the conversion after it overruns the data register.
    pub(crate) late: bool,
}

impl ConverterDma {
    pub(crate) fn new() -> Self {
        let part = &CONTROLLERS[1];
        Self { dma: Dma::new(part.wiring, part.last_data, part.reaches_memory), late: false }
    }
}

impl Device for ConverterDma {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        Device::read(&mut self.dma, register, registers, context)
    }
    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::write(&mut self.dma, register, value, registers, context);
    }
    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.late && (change.instance, change.request, change.level) == ("ADC1", DMA_REQUEST, Level::High) {
            self.late = false;
            return;
        }
        Device::on_request(&mut self.dma, change, registers, context);
    }
    fn on_access(&mut self, token: u64, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_access(&mut self.dma, token, value, registers, context);
    }
    fn on_refused(&mut self, token: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_refused(&mut self.dma, token, registers, context);
    }
    fn reset(&mut self) {
        Device::reset(&mut self.dma);
        self.late = false;
    }
    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.dma, registers, context);
    }
}

//! What the block knows when it starts: its parameter record, or why it has none.

use can_wire::NodeId;
use can_wire::parameters::{self, BadRecord, ParameterRecord};
use model_core::monitor::Monitor;
use model_core::params::Params;

use crate::ports::Storage;

/// What the block works with until the next reset.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Its name on the bus.
    pub node: NodeId,
    /// The checked model.
    pub monitor: Monitor,
    /// `None`: from the record. Otherwise why the record was refused and
    /// [`Params::ZHOU_2023`] took its place, which is not calibrated and so never gives a preload.
    pub refused: Option<BadRecord>,
}

impl Settings {
    /// Reads the record.
    ///
    /// # Errors
    /// The built-in parameters do not build, which a test excludes.
    pub fn load(storage: &impl Storage) -> Result<Settings, model_core::Error> {
        match Self::of_record(storage.record()) {
            Ok(settings) => Ok(settings),
            Err(refused) => Self::built_in(refused),
        }
    }

    fn of_record(bytes: &[u8]) -> Result<Settings, BadRecord> {
        let ParameterRecord { node, params } = parameters::decode(bytes)?;
        let node = NodeId::new(node).ok_or(BadRecord::NodeId(node))?;
        let monitor = params.build().map_err(BadRecord::Params)?;
        Ok(Settings { node, monitor, refused: None })
    }

    fn built_in(refused: BadRecord) -> Result<Settings, model_core::Error> {
        Ok(Settings { node: NodeId::FIRST, monitor: Params::ZHOU_2023.build()?, refused: Some(refused) })
    }

    /// The record's state in a word, for the log.
    pub fn record_state(&self) -> &'static str {
        match self.refused {
            None => "read",
            Some(BadRecord::Erased) => "erased",
            Some(BadRecord::Magic) => "no record",
            Some(BadRecord::Version(_)) => "unknown version",
            Some(BadRecord::Length) => "wrong length",
            Some(BadRecord::Crc) => "wrong checksum",
            Some(BadRecord::Body) => "unreadable",
            Some(BadRecord::Params(_)) => "parameter out of range",
            Some(BadRecord::NodeId(_)) => "node number out of range",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Bytes(Vec<u8>);
    impl Storage for Bytes {
        fn record(&self) -> &[u8] {
            &self.0
        }
    }

    fn stored(record: &ParameterRecord) -> Bytes {
        let mut buffer = [0; parameters::MAX_SIZE];
        let record = parameters::encode(record, &mut buffer).unwrap();
        let mut bytes = record.to_vec();
        bytes.resize(4096, 0xFF);
        Bytes(bytes)
    }

    #[test]
    fn a_good_record_is_used() {
        let mut params = Params::ZHOU_2023;
        params.calibrated = true;
        params.moved_mass_kg = 3.5;
        let settings = Settings::load(&stored(&ParameterRecord { node: 17, params })).unwrap();
        assert_eq!(settings.node.get(), 17);
        assert_eq!(settings.monitor.params(), &params);
        assert_eq!(settings.record_state(), "read");
    }

    #[test]
    fn without_a_record_the_block_is_uncalibrated() {
        let mut flipped =
            stored(&ParameterRecord { node: 17, params: Params { calibrated: true, ..Params::ZHOU_2023 } });
        flipped.0[30] ^= 4;
        for (storage, state) in
            [(Bytes(vec![0xFF; 4096]), "erased"), (Bytes(vec![0; 4096]), "no record"), (flipped, "wrong checksum")]
        {
            let settings = Settings::load(&storage).unwrap();
            assert_eq!(settings.record_state(), state);
            assert_eq!(settings.node.get(), 1);
            assert!(!settings.monitor.params().calibrated);
        }
    }
}

//! Start-up: reads the parameter record, or finds why there is none.

use can_wire::NodeId;
use can_wire::parameters::{self, BadRecord};
use can_wire::service::Settings as Set;
use model_core::monitor::Monitor;
use model_core::params::Params;

use crate::ports::Storage;
use crate::store;

/// Parameters and settings that the block uses until the next reset.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Its node on the bus.
    pub node: NodeId,
    /// The checked model.
    pub monitor: Monitor,
    /// `None`: the parameters are from the record. Otherwise why the record was refused; [`Params::ZHOU_2023`] then
    /// takes its place, which is not calibrated and so never gives a preload.
    pub refused: Option<BadRecord>,
    /// [`image_hash`](parameters::image_hash) of the record; 0 without one.
    pub image_hash: u32,
    /// Number of images saved before it; 0 for a programmer's.
    pub generation: u32,
    /// What a client has set and kept.
    pub set: Set,
}

/// Why a record was refused; an error of the model counts as one of the record.
struct Refused(BadRecord);

impl From<model_core::Error> for Refused {
    fn from(why: model_core::Error) -> Self {
        Refused(BadRecord::Params(why))
    }
}

impl Settings {
    /// Not loaded yet.
    pub const UNSET: Settings = Settings {
        node: NodeId::FIRST,
        monitor: Monitor::UNSET,
        refused: None,
        image_hash: 0,
        generation: 0,
        set: Set::DELIVERED,
    };

    /// Reads the record in place: the settings are too large for the stack.
    ///
    /// # Errors
    /// The built-in parameters do not build, which a test excludes.
    pub fn load(&mut self, storage: &impl Storage) -> Result<(), model_core::Error> {
        let stored = store::newest(storage.regions());
        let bytes = stored.record;
        self.set = stored.settings();
        let read = self.monitor.set_up(|params| parameters::decode_into(bytes, params).map_err(Refused));
        match read {
            Ok(node) => {
                self.node = node;
                self.refused = None;
                self.image_hash = parameters::image_hash(bytes).unwrap_or(0);
                self.generation = stored.generation.unwrap_or(0);
                Ok(())
            }
            Err(Refused(why)) => {
                self.node = NodeId::FIRST;
                self.refused = Some(why);
                self.image_hash = 0;
                self.generation = 0;
                self.set = Set::DELIVERED;
                self.monitor.set_up(|params| {
                    *params = Params::ZHOU_2023;
                    Ok(())
                })
            }
        }
    }

    /// State of the record in a word, for the log.
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
    use can_wire::parameters::ParameterRecord;

    fn load(storage: &impl Storage) -> Settings {
        let mut settings = Settings::UNSET;
        settings.load(storage).unwrap();
        settings
    }

    struct Bytes(Vec<u8>);
    impl Storage for Bytes {
        fn regions(&self) -> [&[u8]; 2] {
            [&self.0, &[]]
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
        let settings = load(&stored(&ParameterRecord { node: 17, params }));
        assert_eq!(settings.node.get(), 17);
        assert_eq!(settings.monitor.params(), &params);
        assert_eq!(settings.record_state(), "read");
        assert_ne!(settings.image_hash, 0);
    }

    #[test]
    fn without_a_record_the_block_is_uncalibrated() {
        let mut flipped =
            stored(&ParameterRecord { node: 17, params: Params { calibrated: true, ..Params::ZHOU_2023 } });
        flipped.0[30] ^= 4;
        for (storage, state) in
            [(Bytes(vec![0xFF; 4096]), "erased"), (Bytes(vec![0; 4096]), "no record"), (flipped, "wrong checksum")]
        {
            let settings = load(&storage);
            assert_eq!(settings.record_state(), state);
            assert_eq!(settings.node.get(), 1);
            assert_eq!(settings.image_hash, 0);
            assert!(!settings.monitor.params().calibrated);
            // the whole model is the built-in one; nothing is left of what was read before the error was found
            assert_eq!(settings.monitor.params(), &Params::ZHOU_2023);
        }
    }
}

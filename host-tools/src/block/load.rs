//! Upload of a parameter image: sends it and waits until the block has saved it.

use std::time::Duration;

use can_wire::service::client::{self, Reply};
use can_wire::service::{Abort, Field, MAX_IMAGE, UploadState};

use super::{Client, ClientError, object};

/// Saving takes a block at most some seconds: a sector of flash is slow to erase.
const SAVED_WITHIN: Duration = Duration::from_secs(15);

/// Time between two checks whether it has been saved.
const LOOK: Duration = Duration::from_millis(100);

impl Client<'_> {
    /// Sends an image, has it checked by its CRC-32 and saved. It is used from the block's next start on. `progress`
    /// is called with the bytes sent and all bytes.
    ///
    /// # Errors
    /// [`ClientError::ImageSize`]; [`ClientError::NotKept`]; otherwise as [`write`](Client::write). The previous image
    /// stays in all cases.
    pub fn load_image(&mut self, image: &[u8], mut progress: impl FnMut(usize, usize)) -> Result<(), ClientError> {
        if !(1..=MAX_IMAGE).contains(&image.len()) {
            return Err(ClientError::ImageSize(image.len()));
        }
        let (node, domain) = (self.node, object(Field::Image));
        let begin = client::begin(node, domain, image.len() as u32);
        match self.ask(domain, &begin, true)? {
            Reply::Taken => {}
            other => return Err(self.otherwise(domain, other)),
        }
        let mut sent = 0;
        for (n, part) in image.chunks(client::SEGMENT).enumerate() {
            let toggle = n % 2 == 1;
            sent += part.len();
            let last = sent == image.len();
            match self.ask(domain, &client::segment(node, part, toggle, last), true)? {
                Reply::SegmentTaken(answered) if answered == toggle => {}
                // the answer was lost and the segment sent again: the block has it already
                Reply::Refused(Abort::Toggle) => {}
                Reply::Refused(Abort::Command) if last => {}
                other => return Err(self.otherwise(domain, other)),
            }
            progress(sent, image.len());
        }
        match self.write(Field::ImageChecksum, can_wire::crc32(image)) {
            Ok(()) | Err(ClientError::Silent { .. }) => {}
            Err(why) => return Err(why),
        }
        self.await_saving()
    }

    fn await_saving(&mut self) -> Result<(), ClientError> {
        let deadline = self.bus.now() + SAVED_WITHIN;
        loop {
            let code = self.read(Field::ImageState)?;
            let state = UploadState::from_code(code as u8).unwrap_or(UploadState::Failed);
            match state {
                UploadState::Saved => return Ok(()),
                UploadState::Saving if self.bus.now() < deadline => self.pause(LOOK)?,
                state => return Err(ClientError::NotKept { node: self.node.get(), state }),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::desk::{Desk, Setup};
    use can_wire::NodeId;
    use can_wire::service::objects::RESTART;
    use can_wire::service::server::DELIVERED_KEY;

    fn image(length: usize) -> Vec<u8> {
        (0..length).map(|n| (n * 7 % 251) as u8).collect()
    }

    #[test]
    fn an_image_is_kept_and_used_from_the_next_start_on() {
        for (length, loss) in [(1, 0), (7, 0), (8, 0), (1024, 0), (1024, 50)] {
            let mut desk = Desk::new(Setup { loss, ..Setup::default() });
            let mut client = Client::new(&mut desk, NodeId::FIRST);
            while client.unlock(DELIVERED_KEY).is_err() {}
            let mut last = (0, 0);
            client.load_image(&image(length), |sent, of| last = (sent, of)).expect("taken");
            assert_eq!(last, (length, length));
            assert_eq!(client.read(Field::ImageActive).expect("answers"), 0);
            while client.read(Field::BootCount).expect("answers") == 1 {
                let _ = client.write(Field::Restart, RESTART);
            }
            let hash = can_wire::crc32(&image(length));
            assert_eq!(client.read(Field::ImageActive).expect("answers"), hash);
        }
    }

    #[test]
    fn a_block_without_a_store_says_so() {
        let mut desk = Desk::new(Setup { keeps: false, ..Setup::default() });
        let mut client = Client::new(&mut desk, NodeId::FIRST);
        client.unlock(DELIVERED_KEY).expect("the key");
        let error = client.load_image(&image(20), |_, _| {}).expect_err("no store").to_string();
        assert_eq!(error, "node 1: the image arrived but was not kept (failed); the one before stays");
        for length in [0, 1025] {
            assert!(matches!(client.load_image(&image(length), |_, _| {}), Err(ClientError::ImageSize(_))));
        }
    }

    #[test]
    fn nothing_is_loaded_while_the_carriage_moves() {
        let mut desk = Desk::new(Setup { moves: true, ..Setup::default() });
        let mut client = Client::new(&mut desk, NodeId::FIRST);
        client.unlock(DELIVERED_KEY).expect("the key");
        let error = client.load_image(&image(20), |_, _| {}).expect_err("it moves");
        assert!(matches!(error, ClientError::Refused { why: Abort::State, .. }), "{error}");
    }
}

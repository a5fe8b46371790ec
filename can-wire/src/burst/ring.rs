//! Ring of segments that takes and drops whole records.

use super::frames::SEGMENT;
use super::pack::{END_SEGMENTS, Packed};

/// Room for N segments.
#[derive(Clone, Debug)]
pub(crate) struct Ring<const N: usize> {
    bytes: [[u8; SEGMENT]; N],
    begins: [bool; N],
    first: usize,
    length: usize,
    records: u16,
}

impl<const N: usize> Ring<N> {
    pub(crate) const fn new() -> Self {
        Ring { bytes: [[0; SEGMENT]; N], begins: [false; N], first: 0, length: 0, records: 0 }
    }

    /// Segments in it.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Number of records whose first segment is in it.
    pub(crate) fn records(&self) -> u16 {
        self.records
    }

    /// Number of segments that still fit.
    pub(crate) fn room(&self) -> usize {
        N - self.length
    }

    /// The segment at this distance from the oldest.
    pub(crate) fn get(&self, distance: usize) -> Option<(bool, [u8; SEGMENT])> {
        if distance >= self.length {
            return None;
        }
        let at = (self.first + distance) % N;
        Some((*self.begins.get(at)?, *self.bytes.get(at)?))
    }

    /// Puts a record at the end; without room returns `false` and changes nothing.
    #[inline(never)]
    pub(crate) fn push(&mut self, record: &Packed) -> bool {
        let segments = record.segments();
        if segments.len() > self.room() {
            return false;
        }
        for (n, segment) in segments.iter().enumerate() {
            self.set((self.first + self.length) % N, n == 0, segment);
            self.length += 1;
        }
        self.records = self.records.saturating_add(1);
        true
    }

    /// Puts a header before the oldest segment; where there is no room, it replaces the oldest records.
    pub(crate) fn lead(&mut self, header: &Packed) {
        while self.room() < END_SEGMENTS {
            self.drop_record();
        }
        for (n, segment) in header.segments().iter().enumerate().rev() {
            self.first = (self.first + N - 1) % N;
            self.set(self.first, n == 0, segment);
            self.length += 1;
        }
        self.records = self.records.saturating_add(1);
    }

    /// Forgets this many of the oldest segments.
    #[inline(never)]
    pub(crate) fn release(&mut self, segments: usize) {
        for _ in 0..segments.min(self.length) {
            if self.begins.get(self.first) == Some(&true) {
                self.records = self.records.saturating_sub(1);
            }
            self.first = (self.first + 1) % N;
            self.length -= 1;
        }
    }

    /// Forgets the oldest record.
    #[inline(never)]
    pub(crate) fn drop_record(&mut self) {
        self.release(1);
        while self.length > 0 && self.begins.get(self.first) == Some(&false) {
            self.release(1);
        }
    }

    pub(crate) fn clear(&mut self) {
        (self.first, self.length, self.records) = (0, 0, 0);
    }

    fn set(&mut self, at: usize, begins: bool, segment: &[u8; SEGMENT]) {
        if let (Some(bytes), Some(flag)) = (self.bytes.get_mut(at), self.begins.get_mut(at)) {
            (*bytes, *flag) = (*segment, begins);
        }
    }
}

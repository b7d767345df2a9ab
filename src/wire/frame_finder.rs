//! Finds frames of one kind in a stream of bytes.
//!
//! It assumes nothing of where the stream begins, drops one byte at a time until header and check sum fit, and counts
//! the dropped bytes.

/// A frame of `BYTES` bytes on the wire.
pub trait WireFrame<const BYTES: usize>: Sized {
    /// Beginning of every frame: two bytes of sync, version, length.
    const HEADER: [u8; 4];

    /// The frame in these bytes; `None` if header or check sum do not fit.
    fn decode(bytes: &[u8; BYTES]) -> Option<Self>;

    /// Number of the frame, wrapping.
    fn number(&self) -> u32;

    /// Numbers before this one that no frame was made for.
    fn skipped(&self) -> u32 {
        0
    }
}

/// Statistics of a [`FrameFinder`] so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StreamStatistics {
    /// Whole frames.
    pub frames: u64,
    /// Bytes that belong to no frame, those of damaged frames included.
    pub bytes_skipped: u64,
    /// Candidates with the right header and a wrong check sum.
    pub bad_checksums: u64,
    /// Sync words followed by another version or length, bytes that happen to look like one included.
    pub other_versions: u64,
    /// Frames missing by the sequence of numbers.
    pub frames_lost: u64,
    /// Frames whose number is not after the previous one's: the unit started again.
    pub restarts: u64,
}

/// Finds the frames `F` in a stream of bytes.
#[derive(Debug, Clone)]
pub struct FrameFinder<F, const BYTES: usize> {
    buffer: [u8; BYTES],
    filled: usize,
    previous: Option<u32>,
    statistics: StreamStatistics,
    kind: core::marker::PhantomData<F>,
}

impl<F, const BYTES: usize> Default for FrameFinder<F, BYTES> {
    fn default() -> Self {
        Self {
            buffer: [0; BYTES],
            filled: 0,
            previous: None,
            statistics: StreamStatistics::default(),
            kind: core::marker::PhantomData,
        }
    }
}

impl<F: WireFrame<BYTES>, const BYTES: usize> FrameFinder<F, BYTES> {
    /// Before the first byte.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes one byte; gives a frame when it was the frame's last. A damaged frame may have held the
    /// beginning of the next one, so its bytes are looked through again, all but the first.
    pub fn push(&mut self, byte: u8) -> Option<F> {
        if let Some(place) = self.buffer.get_mut(self.filled) {
            *place = byte;
            self.filled += 1;
        }
        self.drop_until_header();
        if self.filled < BYTES {
            return None;
        }
        match F::decode(&self.buffer) {
            Some(frame) => {
                self.filled = 0;
                self.account(&frame);
                Some(frame)
            }
            None => {
                self.statistics.bad_checksums += 1;
                self.drop_front(1);
                self.drop_until_header();
                None
            }
        }
    }

    /// Returns the statistics so far.
    pub fn statistics(&self) -> &StreamStatistics {
        &self.statistics
    }

    /// Bytes at the end that may be the beginning of a frame.
    pub fn pending_bytes(&self) -> usize {
        self.filled
    }

    /// Drops bytes until the rest could be the beginning of a frame.
    fn drop_until_header(&mut self) {
        let rest = |from: usize| self.buffer.get(from..self.filled).unwrap_or_default();
        let fits = |from: &usize| {
            rest(*from)
                .iter()
                .zip(F::HEADER)
                .all(|(byte, due)| *byte == due)
        };
        let first = (0..self.filled).find(fits).unwrap_or(self.filled);
        let [sync, second, ..] = F::HEADER;
        let foreign = (0..first)
            .filter(|from| rest(*from).starts_with(&[sync, second]))
            .count();
        self.statistics.other_versions += foreign as u64;
        self.drop_front(first);
    }

    fn drop_front(&mut self, bytes: usize) {
        if bytes > 0 && bytes <= self.filled {
            self.buffer.copy_within(bytes..self.filled, 0);
            self.filled -= bytes;
            self.statistics.bytes_skipped += bytes as u64;
        }
    }

    fn account(&mut self, frame: &F) {
        self.statistics.frames += 1;
        let number = frame.number();
        if let Some(previous) = self.previous.replace(number) {
            // Half the range ahead is a gap, half behind a restart.
            match number.wrapping_sub(previous) {
                step @ 1..=0x7FFF_FFFF => {
                    let lost = (step - 1).saturating_sub(frame.skipped());
                    self.statistics.frames_lost += u64::from(lost);
                }
                _ => self.statistics.restarts += 1,
            }
        }
    }
}

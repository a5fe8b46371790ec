//! Acquire: keeps the sampler running and turns its samples into numbered blocks.

use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Sender;
use model_core::sample::{RawBlock, SAMPLES_PER_BLOCK};

use crate::liveness::{Liveness, Member};
use crate::log::warning;
use crate::ports::{CHANNELS, Clock, SampleRun, SampleSource, Samples};
use crate::timeline::{BLOCK_US, Timeline};

/// Blocks that may wait for the estimator.
pub const DEPTH: usize = 2;

/// Time without a block after which a run is given up, µs. A converter that stopped raises no error anywhere else: its
/// DMA just waits. Blocks come every 10 ms to within a fraction of that.
const TIMEOUT_US: u64 = 2 * BLOCK_US;

/// Pause before the next run, µs, so that a sampler which fails at once leaves time for everyone else.
const PAUSE_US: u64 = BLOCK_US;

/// Samples in, blocks out.
///
/// After any interruption the sampler starts from scratch and the ticks jump by the time lost, so that every reader of
/// the blocks sees the gap. A block that finds no room is lost the same way.
pub struct Acquire<'a, M: RawMutex, S, C> {
    /// The sampler.
    pub source: S,
    /// Output of blocks.
    pub blocks: Sender<'a, M, RawBlock, DEPTH>,
    /// Output of copies for bursts; a copy that finds no room is missing in the burst only.
    pub copies: Sender<'a, M, RawBlock, DEPTH>,
    /// Time.
    pub clock: C,
    /// Signs of life.
    pub liveness: &'a Liveness,
}

impl<M: RawMutex, S: SampleSource, C: Clock> Acquire<'_, M, S, C> {
    /// Samples for ever.
    pub async fn run(mut self) -> ! {
        let mut timeline = Timeline::new();
        let mut samples = Samples::EMPTY;
        loop {
            let mut run = self.source.start();
            timeline.resume(self.clock.now_us());
            // a sampler that stays silent is logged once
            let mut delivers = false;
            loop {
                let deadline = self.clock.sleep_until(self.clock.now_us() + TIMEOUT_US);
                match select(run.block(&mut samples), deadline).await {
                    Either::First(Ok(())) => {
                        let block = numbered(timeline.tick(), &samples);
                        if self.blocks.try_send(block).is_err() {
                            warning!("block {=u32} lost: the estimator is busy", block.tick);
                        }
                        let _ = self.copies.try_send(block);
                        self.liveness.report(Member::Acquire);
                        delivers = true;
                    }
                    Either::First(Err(interruption)) => {
                        if delivers {
                            warning!("sampler restarts: {=str}", interruption.name());
                        }
                        break;
                    }
                    Either::Second(()) => {
                        if delivers {
                            warning!("sampler restarts: no samples");
                        }
                        break;
                    }
                }
            }
            drop(run);
            self.liveness.report(Member::Acquire);
            self.clock.sleep_until(self.clock.now_us() + PAUSE_US).await;
        }
    }
}

/// Separates the channels.
fn numbered(tick: u32, samples: &Samples) -> RawBlock {
    let mut block =
        RawBlock { tick, force: [0; SAMPLES_PER_BLOCK], temperature: [0; SAMPLES_PER_BLOCK], position: samples.counts };
    let (scans, _) = samples.codes.as_chunks::<CHANNELS>();
    for ((scan, force), temperature) in scans.iter().zip(&mut block.force).zip(&mut block.temperature) {
        [*force, *temperature] = *scan;
    }
    block
}

#[cfg(test)]
mod tests {
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use embassy_sync::channel::Channel;

    use super::*;
    use crate::runners::rehearsal::{Desk, Event, Script};

    #[test]
    fn channels_are_separated() {
        let mut samples = Samples::EMPTY;
        for n in 0..SAMPLES_PER_BLOCK as u16 {
            samples.codes[2 * usize::from(n)] = 100 + n;
            samples.codes[2 * usize::from(n) + 1] = 3000 + n;
            samples.counts[usize::from(n)] = 65_530_u16.wrapping_add(n);
        }
        let block = numbered(7, &samples);
        assert_eq!(block.tick, 7);
        for n in 0..SAMPLES_PER_BLOCK {
            assert_eq!(block.force[n], 100 + n as u16);
            assert_eq!(block.temperature[n], 3000 + n as u16);
            assert_eq!(block.position[n], 65_530_u16.wrapping_add(n as u16));
        }
    }

    /// Runs the script for `for_us` and returns the ticks of the blocks, with the number of starts of the sampler.
    fn ticks(script: Vec<Event>, for_us: u64) -> (Vec<u32>, usize) {
        let desk = Desk::new();
        let liveness = Liveness::new();
        let blocks = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let copies = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let source = Script::new(&desk, script);
        let starts = source.starts.clone();
        let acquire =
            Acquire { source, blocks: blocks.sender(), copies: copies.sender(), clock: &desk, liveness: &liveness };
        let mut ticks = Vec::new();
        desk.run_watching(for_us, acquire.run(), || {
            while let Ok(block) = blocks.try_receive() {
                ticks.push(block.tick);
            }
        });
        (ticks, starts.get())
    }

    #[test]
    fn an_overrun_restarts_the_sampler_and_shows_in_the_ticks() {
        let script = vec![Event::Block, Event::Block, Event::Overrun, Event::Block, Event::Block];
        // blocks end at 10 and 20 ms; the overrun is found at 30 ms, the next run starts at 40 ms with tick 4
        assert_eq!(ticks(script, 61_000), (vec![0, 1, 4, 5], 2));
    }

    #[test]
    fn a_sampler_that_stopped_is_restarted_after_the_timeout() {
        let script = vec![Event::Block, Event::Silence, Event::Block];
        // silent from 10 ms, given up at 30 ms, next run from 40 ms
        assert_eq!(ticks(script, 51_000), (vec![0, 4], 2));
    }

    #[test]
    fn a_sampler_that_fails_at_once_is_tried_again_at_leisure() {
        let (ticks, starts) = ticks(vec![Event::Broken; 1000], 100_500);
        assert!(ticks.is_empty());
        assert_eq!(starts, 11);
    }

    #[test]
    fn blocks_that_nobody_takes_are_lost_and_leave_a_gap() {
        let desk = Desk::new();
        let liveness = Liveness::new();
        let blocks = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let source = Script::new(&desk, Vec::new());
        let copies = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let acquire =
            Acquire { source, blocks: blocks.sender(), copies: copies.sender(), clock: &desk, liveness: &liveness };
        let mut ticks = Vec::new();
        desk.run_watching(100_500, acquire.run(), || {
            if desk.now_us() >= 50_000 {
                while let Ok(block) = blocks.try_receive() {
                    ticks.push(block.tick);
                }
            }
        });
        assert_eq!(ticks, [0, 1, 5, 6, 7, 8, 9]);
    }
}

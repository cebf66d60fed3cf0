//! Device time of each stage, from timestamps between its commands. Nothing waits for them: they are read with
//! what the host fetches anyway.

use crate::plan::Stage;
use std::collections::BTreeMap;

/// Timestamps that are kept until they are read.
const MARKS: u32 = 4096;
/// Kept free for one submission: it brings two a stage at most, and some for the looks at the solver.
const MARGIN: u32 = 128;

/// What a device must offer for a clock.
pub(super) const FEATURES: wgpu::Features =
    wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

/// The clock of a device.
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    /// Seconds a tick.
    period: f64,
    /// What follows each timestamp: a stage, or nothing that belongs to one.
    marks: Vec<Option<Stage>>,
    /// Timestamps on their way to the host.
    fetched: usize,
    /// Since the start, as of the last reading [s].
    pub seconds: BTreeMap<Stage, f64>,
}

impl Clock {
    /// A clock, if the device has what it takes.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        if !device.features().contains(FEATURES) {
            return None;
        }
        let buffer = |label, usage| {
            let size = u64::from(MARKS * wgpu::QUERY_SIZE);
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        Some(Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("clock"),
                ty: wgpu::QueryType::Timestamp,
                count: MARKS,
            }),
            resolved: buffer("timestamps", Usage::QUERY_RESOLVE | Usage::COPY_SRC),
            readable: buffer("timestamps for the host", Usage::MAP_READ | Usage::COPY_DST),
            period: 1e-9 * f64::from(queue.get_timestamp_period()),
            marks: Vec::with_capacity(MARKS as usize),
            fetched: 0,
            seconds: BTreeMap::new(),
        })
    }

    /// From here on commands belong to `stage`.
    pub fn mark(&mut self, encoder: &mut wgpu::CommandEncoder, stage: Option<Stage>) {
        if self.marks.len() < MARKS as usize && self.marks.last() != Some(&stage) {
            encoder.write_timestamp(&self.queries, self.marks.len() as u32);
            self.marks.push(stage);
        }
    }

    /// Whether the timestamps should be read before more come.
    pub(crate) fn is_full(&self) -> bool {
        self.marks.len() as u32 > MARKS - MARGIN
    }

    /// Record that the timestamps go to the host; the buffer to map, and its bytes.
    pub(crate) fn fetch(&mut self, encoder: &mut wgpu::CommandEncoder) -> Option<(wgpu::Buffer, u64)> {
        self.mark(encoder, None);
        let count = self.marks.len() as u32;
        if count < 2 {
            return None;
        }
        let bytes = u64::from(count * wgpu::QUERY_SIZE);
        encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, bytes);
        self.fetched = count as usize;
        Some((self.readable.clone(), bytes))
    }

    /// Take in the `ticks` fetched.
    pub fn read(&mut self, ticks: &[u64]) {
        add(&mut self.seconds, &self.marks[..self.fetched], ticks, self.period);
        self.marks.drain(..self.fetched);
        self.fetched = 0;
    }
}

/// Add to `seconds` the time between each of `ticks` and the next, by what lies between them.
fn add(seconds: &mut BTreeMap<Stage, f64>, marks: &[Option<Stage>], ticks: &[u64], period: f64) {
    for (pair, stage) in ticks.windows(2).zip(marks) {
        if let Some(stage) = stage {
            // Some drivers let timestamps of neighbouring commands change places.
            *seconds.entry(*stage).or_default() += pair[1].saturating_sub(pair[0]) as f64 * period;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_to_the_stage_between_two_marks_and_gaps_to_none() {
        let mut seconds = BTreeMap::from([(Stage::Correct, 1.0)]);
        let (a, b) = (Some(Stage::Predict), Some(Stage::Correct));
        // Two submissions; between them 100 ticks that nobody used.
        add(&mut seconds, &[a, b, None, b, None], &[10, 12, 15, 115, 116], 0.5);
        assert_eq!(seconds, BTreeMap::from([(Stage::Predict, 1.0), (Stage::Correct, 3.0)]));
        add(&mut seconds, &[a, None], &[10, 9], 0.5);
        assert_eq!(seconds[&Stage::Predict], 1.0);
    }
}

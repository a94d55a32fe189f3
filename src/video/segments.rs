//! Packets → segments: stretches that decode alone, to the same bits as within the whole file.
//!
//! A stretch may begin only at a packet that resets the decoder (IDR in H.264, IRAP in HEVC, any key frame of a
//! codec without long references) and only where no later packet is shown before it. So no frame of one segment
//! is ever a reference of another, and frames of different segments never interleave in time.

use std::collections::VecDeque;

use ffmpeg_the_third as ffmpeg;

use ffmpeg::Packet;
use ffmpeg::codec::Id;

use super::container::Container;

/// Frames below which a segment is joined with the next: a decoder has to be drained after each.
const SHORTEST_PACKETS: usize = 24;
/// Packets after which a file is taken to have no second entry point.
const LONGEST_PACKETS: usize = 1024;
/// Compressed bytes after which a file is taken to have no second entry point.
const LONGEST_BYTES: usize = 48 << 20;

/// A stretch of packets that decodes alone.
#[derive(Default)]
pub struct Segment {
    /// In decoding order.
    pub packets: VecDeque<Packet>,
    bytes: usize,
    first_pts: Option<i64>,
    least_pts: Option<i64>,
    greatest_pts: Option<i64>,
    stamps_missing: bool,
}

impl Segment {
    fn push(&mut self, packet: Packet) {
        self.bytes += packet.size();
        match packet.pts() {
            Some(pts) => {
                self.first_pts.get_or_insert(pts);
                self.least_pts = Some(self.least_pts.map_or(pts, |p| p.min(pts)));
                self.greatest_pts = Some(self.greatest_pts.map_or(pts, |p| p.max(pts)));
            }
            None => self.stamps_missing = true,
        }
        self.packets.push_back(packet);
    }

    /// Nothing in `self` is shown before its first packet, nor anything of `earlier` after it.
    fn stands_apart_from(&self, earlier: &Segment) -> bool {
        !self.stamps_missing
            && !earlier.stamps_missing
            && self.least_pts == self.first_pts
            && match (earlier.greatest_pts, self.first_pts) {
                (Some(before), Some(first)) => before < first,
                _ => false,
            }
    }

    fn append(&mut self, later: Segment) {
        for packet in later.packets {
            self.push(packet);
        }
    }
}

/// Splits a container's packets into segments.
pub struct Segmenter {
    codec: Id,
    nal_length_bytes: Option<usize>,
    /// Complete, not yet handed out.
    ready: Option<Segment>,
    /// Held back until its successor is known to stand apart.
    held: Option<Segment>,
    current: Segment,
    /// The first read error, after which the packets end.
    pub read_error: Option<String>,
    /// Packets read.
    pub packets: u64,
    finished: bool,
}

impl Segmenter {
    /// For the packets of `container`.
    pub fn new(container: &Container) -> Self {
        Self {
            codec: container.codec,
            nal_length_bytes: container.nal_length_bytes,
            ready: None,
            held: None,
            current: Segment::default(),
            read_error: None,
            packets: 0,
            finished: false,
        }
    }

    /// Reads ahead, within bounds, and says whether the recording can be split.
    pub fn can_split(&mut self, container: &mut Container) -> bool {
        while self.ready.is_none() && !self.finished {
            self.ready = self.step(container);
            let waiting = [self.held.as_ref(), Some(&self.current)];
            let packets: usize = waiting.iter().flatten().map(|s| s.packets.len()).sum();
            let bytes: usize = waiting.iter().flatten().map(|s| s.bytes).sum();
            if self.ready.is_none() && (packets >= LONGEST_PACKETS || bytes >= LONGEST_BYTES) {
                return false;
            }
        }
        self.ready.is_some()
    }

    /// The next segment, in order; `None` at the end.
    pub fn next(&mut self, container: &mut Container) -> Option<Segment> {
        if let Some(segment) = self.ready.take() {
            return Some(segment);
        }
        while !self.finished {
            if let Some(segment) = self.step(container) {
                return Some(segment);
            }
        }
        if !self.current.packets.is_empty() {
            let ready = self.turn_over();
            if ready.is_some() {
                return ready;
            }
        }
        self.held.take()
    }

    /// The next packet, in order, for a recording that cannot be split.
    pub fn next_packet(&mut self, container: &mut Container) -> Option<Packet> {
        loop {
            for waiting in [self.ready.as_mut(), self.held.as_mut(), Some(&mut self.current)].into_iter().flatten() {
                if let Some(packet) = waiting.packets.pop_front() {
                    return Some(packet);
                }
            }
            if self.finished {
                return None;
            }
            if let Some(segment) = self.step(container) {
                self.ready = Some(segment);
            }
        }
    }

    /// Reads one packet into the current segment; hands out the segment that is thereby known to be complete.
    fn step(&mut self, container: &mut Container) -> Option<Segment> {
        let packet = match container.next_packet() {
            Ok(Some(packet)) => packet,
            Ok(None) => {
                self.finished = true;
                return None;
            }
            Err(error) => {
                self.read_error = Some(error.to_string());
                self.finished = true;
                return None;
            }
        };
        self.packets += 1;
        let begins = self.current.packets.len() >= SHORTEST_PACKETS && self.is_entry_point(&packet);
        let ready = if begins { self.turn_over() } else { None };
        self.current.push(packet);
        ready
    }

    /// The current segment is complete: hands out the held one if the current one stands apart, else joins them.
    fn turn_over(&mut self) -> Option<Segment> {
        let current = std::mem::take(&mut self.current);
        match self.held.take() {
            None => {
                self.held = Some(current);
                None
            }
            Some(held) if current.stands_apart_from(&held) => {
                self.held = Some(current);
                Some(held)
            }
            Some(mut held) => {
                held.append(current);
                self.held = Some(held);
                None
            }
        }
    }

    fn is_entry_point(&self, packet: &Packet) -> bool {
        let Some(data) = packet.data() else { return false };
        match self.codec {
            Id::H264 => nal_units(data, self.nal_length_bytes).any(|n| n[0] & 0x1f == 5),
            Id::HEVC => nal_units(data, self.nal_length_bytes).any(|n| (16..=21).contains(&((n[0] >> 1) & 0x3f))),
            Id::MJPEG
            | Id::PNG
            | Id::RAWVIDEO
            | Id::PRORES
            | Id::DNXHD
            | Id::DVVIDEO
            | Id::HUFFYUV
            | Id::FFVHUFF
            | Id::UTVIDEO
            | Id::FFV1
            | Id::MPEG4
            | Id::MPEG1VIDEO
            | Id::MPEG2VIDEO
            | Id::VP8
            | Id::VP9 => packet.is_key(),
            // others may keep state across key frames
            _ => false,
        }
    }
}

/// The NAL units of a packet, without their delimiters, none of them empty.
fn nal_units(data: &[u8], length_bytes: Option<usize>) -> Box<dyn Iterator<Item = &[u8]> + '_> {
    match length_bytes {
        Some(length_bytes) => {
            let mut rest = data;
            Box::new(
                std::iter::from_fn(move || {
                    if rest.len() <= length_bytes {
                        return None;
                    }
                    let (head, tail) = rest.split_at(length_bytes);
                    let length = head.iter().fold(0usize, |n, b| n << 8 | usize::from(*b)).min(tail.len());
                    let (unit, after) = tail.split_at(length);
                    rest = after;
                    Some(unit)
                })
                .filter(|u| !u.is_empty()),
            )
        }
        None => Box::new(data.windows(4).enumerate().filter(|(_, w)| w[..3] == [0, 0, 1]).map(|(i, _)| &data[i + 3..])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_behind_lengths_and_start_codes() {
        let lengths = [0, 0, 0, 2, 0x09, 1, 0, 0, 0, 1, 0x65];
        let kinds: Vec<u8> = nal_units(&lengths, Some(4)).map(|n| n[0] & 0x1f).collect();
        assert_eq!(kinds, [9, 5]);
        let codes = [0, 0, 0, 1, 0x09, 1, 0, 0, 1, 0x65, 7];
        let kinds: Vec<u8> = nal_units(&codes, None).map(|n| n[0] & 0x1f).collect();
        assert_eq!(kinds, [9, 5]);
    }

    #[test]
    fn a_length_beyond_the_packet_ends_the_search() {
        assert_eq!(nal_units(&[0xff, 0xff, 0xff, 0xff, 0x65], Some(4)).count(), 1);
        assert_eq!(nal_units(&[0, 0], Some(4)).count(), 0);
    }
}

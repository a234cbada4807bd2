//! The head that all binary lists have in common.

use crate::fused::{FusedFrame, FusedObject};
use crate::id::{HubId, MAX_NAME_LEN, MapFrame};
use crate::time::Timestamp;
use crate::wire::error::WireError;
use crate::wire::quantity::{MILLI, fixed};
use crate::wire::varint::{MAX_LEN_32, MAX_LEN_64, Reader, Writer};

/// Option; names with their lengths; lineage, origin; sequence and time.
pub(in crate::wire) const MAX_HEAD_LEN: usize = 1 + 2 * (MAX_NAME_LEN + 1) + 3 * MAX_LEN_32 + 2 * MAX_LEN_64;

/// Which list it is, and what the numbers of its objects are relative to.
#[derive(Clone, Copy)]
pub(in crate::wire) struct ListHead {
    pub(in crate::wire) hub: HubId,
    pub(in crate::wire) lineage: u32,
    pub(in crate::wire) sequence: u64,
    pub(in crate::wire) fused_at: Timestamp,
    pub(in crate::wire) map_frame: Option<MapFrame>,
    /// Whole metres, to which the objects' millimetres are relative.
    pub(in crate::wire) origin_m: (i32, i32),
}

impl ListHead {
    pub(super) fn of(frame: &FusedFrame) -> Result<Self, WireError> {
        let FusedFrame { hub, lineage, sequence, fused_at, map_frame, .. } = *frame;
        Ok(Self { hub, lineage, sequence, fused_at, map_frame, origin_m: origin_m(&frame.objects)? })
    }

    pub(in crate::wire) fn write(&self, writer: &mut Writer<'_>) {
        writer.text(self.hub.as_str());
        writer.u32(self.lineage);
        writer.u64(self.sequence);
        writer.i64(self.fused_at.as_nanos());
        writer.bytes([u8::from(self.map_frame.is_some())]);
        if let Some(map_frame) = &self.map_frame {
            writer.text(map_frame.as_str());
        }
        writer.i32(self.origin_m.0);
        writer.i32(self.origin_m.1);
    }

    pub(in crate::wire) fn read(reader: &mut Reader<'_>) -> Result<Self, WireError> {
        let hub = reader.text()?;
        let (lineage, sequence, fused_at_ns) = (reader.u32()?, reader.u64()?, reader.i64()?);
        let map_frame = match reader.bytes()? {
            [0] => None,
            [1] => Some(reader.text()?),
            _ => return Err(postcard::Error::DeserializeBadOption.into()),
        };
        let origin_m = (reader.i32()?, reader.i32()?);
        Ok(Self {
            hub: HubId::new(hub)?,
            lineage,
            sequence,
            fused_at: Timestamp::from_nanos(fused_at_ns),
            map_frame: map_frame.map(MapFrame::new).transpose()?,
            origin_m,
        })
    }

    /// The frame without its lists.
    pub(super) fn frame(&self) -> FusedFrame {
        let Self { hub, lineage, sequence, fused_at, map_frame, .. } = *self;
        let (objects, agents, includes) = (Vec::new(), Vec::new(), Vec::new());
        FusedFrame { hub, lineage, sequence, fused_at, map_frame, objects, agents, includes }
    }
}

/// The whole metres at or below the first object: taken from its millimetres, so that what was decoded
/// has the same origin again.
pub(in crate::wire) fn origin_m(objects: &[FusedObject]) -> Result<(i32, i32), WireError> {
    let Some(FusedObject { bev, .. }) = objects.first() else { return Ok((0, 0)) };
    let metres = |field, value| -> Result<i32, WireError> {
        let millimetres: i64 = fixed(field, value, MILLI)?;
        i32::try_from(millimetres.div_euclid(1000)).map_err(|_| WireError::NotEncodable { field, value })
    };
    Ok((metres("x", bev.x)?, metres("y", bev.y)?))
}

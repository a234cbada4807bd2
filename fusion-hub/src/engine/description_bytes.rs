//! A sensor description in a saved state: the bytes of the wire, which hold it exactly.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use v2x_common::sensor::SensorDescription;
use v2x_common::wire;

pub(super) fn serialize<S: Serializer>(
    description: &Option<SensorDescription>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let encode = |description: &SensorDescription| {
        let mut bytes = Vec::new();
        wire::sensor::encode(description, &mut bytes).map(|()| bytes)
    };
    let bytes = description.as_ref().map(encode).transpose().map_err(serde::ser::Error::custom)?;
    bytes.serialize(serializer)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<SensorDescription>, D::Error> {
    let bytes = Option::<Vec<u8>>::deserialize(deserializer)?;
    bytes.map(|bytes| wire::sensor::decode(&bytes)).transpose().map_err(serde::de::Error::custom)
}

//! The shipped schemas name exactly the fields that are written, and require exactly those that are needed.

use crate::fixture;
use crate::json_twin::{complete_delta_frame, complete_fused_frame};
use serde_json::Value;
use v2x_common::class::Class;
use v2x_common::id::AgentId;
use v2x_common::schemas;
use v2x_common::wire::WireError;
use v2x_common::wire::json::{self, ReportDefaults};

struct Twin {
    schema: Value,
    /// A frame with every field that there is.
    full: Value,
    decode: fn(&[u8]) -> Result<(), WireError>,
}

fn twins() -> [Twin; 4] {
    let mut frame = fixture::detection_frame();
    frame.detections.truncate(1);
    frame.detections[0].source_track = Some(1);
    let read = |text: &[u8]| serde_json::from_slice(text).unwrap();
    [
        Twin {
            schema: read(schemas::DETECTION_FRAME.as_bytes()),
            full: read(&json::encode_detections(&frame).unwrap()),
            decode: |text| {
                let sender = AgentId::new("cam").unwrap();
                json::decode_detections(text, sender, &ReportDefaults::default()).map(drop)
            },
        },
        Twin {
            schema: read(schemas::SENSOR_DESCRIPTION.as_bytes()),
            full: read(&json::encode_sensor(&fixture::sensor_description()).unwrap()),
            decode: |text| json::decode_sensor(text).map(drop),
        },
        Twin {
            schema: read(schemas::FUSED_FRAME.as_bytes()),
            full: read(&json::encode_fused(&complete_fused_frame()).unwrap()),
            decode: |text| json::decode_fused(text).map(drop),
        },
        Twin {
            schema: read(schemas::DELTA_FRAME.as_bytes()),
            full: read(&json::encode_delta(&complete_delta_frame()).unwrap()),
            decode: |text| json::decode_delta(text).map(drop),
        },
    ]
}

/// One object in a frame: where it is, and what the schema says of it.
struct Place<'a> {
    pointer: String,
    schema: &'a Value,
}

/// Every object of the value with its schema; panics where the schema has no word for an array or object.
fn objects<'a>(
    root: &'a Value,
    schema: &'a Value,
    value: &Value,
    pointer: &str,
    places: &mut Vec<Place<'a>>,
) {
    let schema = resolved(root, schema);
    match value {
        Value::Object(fields) => {
            for (name, field) in fields {
                let field_schema = &schema["properties"][name];
                assert!(field_schema.is_object(), "the schema lacks {pointer}/{name}");
                objects(root, field_schema, field, &format!("{pointer}/{name}"), places);
            }
            places.push(Place { pointer: pointer.to_owned(), schema });
        }
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                let prefix = &schema["prefixItems"][i];
                let item_schema = if prefix.is_null() { &schema["items"] } else { prefix };
                assert!(item_schema.is_object(), "the schema lacks the items of {pointer}");
                objects(root, item_schema, item, &format!("{pointer}/{i}"), places);
            }
        }
        _ => {}
    }
}

fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    match schema["$ref"].as_str() {
        Some(reference) => {
            root.pointer(reference.trim_start_matches('#')).expect("references point into the schema")
        }
        None => schema,
    }
}

fn places(twin: &Twin) -> Vec<Place<'_>> {
    let mut places = Vec::new();
    objects(&twin.schema, &twin.schema, &twin.full, "", &mut places);
    places
}

fn required(schema: &Value) -> Vec<&str> {
    schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
}

#[test]
fn the_properties_are_the_fields_of_a_complete_frame() {
    for twin in twins() {
        for Place { pointer, schema } in places(&twin) {
            let written = twin.full.pointer(&pointer).and_then(Value::as_object).unwrap();
            let described = schema["properties"].as_object().unwrap();
            assert!(written.keys().eq(described.keys()), "{pointer}: {written:?}");
            assert_eq!(schema["additionalProperties"], Value::Bool(false), "{pointer}");
        }
    }
}

#[test]
fn every_property_is_described() {
    for twin in twins() {
        for Place { pointer, schema } in places(&twin) {
            for (name, property) in schema["properties"].as_object().unwrap() {
                let description = property["description"].as_str().unwrap_or_default();
                assert!(description.ends_with('.'), "{pointer}/{name}: {description:?}");
            }
        }
    }
}

#[test]
fn only_required_fields_are_required() {
    for twin in twins() {
        for Place { pointer, schema } in places(&twin) {
            let required = required(schema);
            for name in schema["properties"].as_object().unwrap().keys() {
                let mut frame = twin.full.clone();
                frame.pointer_mut(&pointer).and_then(Value::as_object_mut).unwrap().remove(name);
                let outcome = (twin.decode)(frame.to_string().as_bytes());
                if required.contains(&name.as_str()) {
                    let message = outcome.unwrap_err().to_string();
                    assert!(message.contains(&format!("`{name}`")), "without {pointer}/{name}: {message}");
                } else {
                    assert_eq!(outcome, Ok(()), "without {pointer}/{name}");
                }
            }
        }
    }
}

#[test]
fn an_unknown_field_is_refused_by_its_name_at_any_level() {
    for twin in twins() {
        for Place { pointer, .. } in places(&twin) {
            let mut frame = twin.full.clone();
            let object = frame.pointer_mut(&pointer).and_then(Value::as_object_mut).unwrap();
            object.insert("misspelt".to_owned(), Value::Null);
            let message = (twin.decode)(frame.to_string().as_bytes()).unwrap_err().to_string();
            assert!(message.contains("`misspelt`"), "{pointer}: {message}");
        }
    }
}

#[test]
fn the_schemas_list_every_class() {
    for text in [schemas::SENSOR_DESCRIPTION, schemas::FUSED_FRAME, schemas::DELTA_FRAME] {
        let schema: Value = serde_json::from_str(text).unwrap();
        let listed = schema["$defs"]["class"]["enum"].as_array().unwrap();
        assert!(listed.iter().filter_map(Value::as_str).eq(Class::ALL.map(Class::name)));
    }
}

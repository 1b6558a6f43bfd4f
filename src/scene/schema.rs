//! The JSON schema of scene files, by which editors complete and check them.

use super::decode;
use crate::setting::{TableShape, ValueKind};
use serde_json::{Map, Value, json};

/// Return the schema (draft 2020-12), made of the shapes by which scenes are decoded.
pub fn schema() -> Value {
    let mut schema = table_schema(&decode::shape());
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Scene of winkler");
    schema
}

fn table_schema(table: &TableShape) -> Value {
    let mut properties = Map::new();
    for key in table.documented() {
        let mut property = value_schema(&key.kind);
        property["description"] = json!(key.description);
        properties.insert(key.name.to_owned(), property);
    }
    let required: Vec<&str> = table.documented().filter(|key| key.required).map(|key| key.name).collect();
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    if !table.exclusive.is_empty() {
        schema["allOf"] = table.exclusive.iter().map(|pair| json!({ "not": { "required": pair } })).collect();
    }
    schema
}

fn value_schema(kind: &ValueKind) -> Value {
    match kind {
        ValueKind::Text => json!({ "type": "string" }),
        ValueKind::Flag => json!({ "type": "boolean" }),
        ValueKind::Number => json!({ "type": "number" }),
        ValueKind::NonNegativeInteger => json!({ "type": "integer", "minimum": 0 }),
        ValueKind::PositiveInteger => json!({ "type": "integer", "minimum": 1 }),
        ValueKind::OneOf(numbers) => json!({ "enum": numbers }),
        ValueKind::Field => json!({ "type": ["number", "string"] }),
        ValueKind::Word(words) => json!({ "enum": words }),
        ValueKind::List(item) => json!({ "type": "array", "items": value_schema(item) }),
        ValueKind::Table(table) => table_schema(table),
        ValueKind::Map(value) => json!({ "type": "object", "additionalProperties": value_schema(value) }),
        ValueKind::Either(kinds) => json!({ "anyOf": kinds.iter().map(value_schema).collect::<Vec<_>>() }),
    }
}

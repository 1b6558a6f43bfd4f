//! The JSON schema of scene files, by which editors complete and check them.

use super::decode;
use super::shape::{Form, Table};
use serde_json::{Value, json};

/// The schema (draft 2020-12), made of the tables by which scenes are decoded.
pub fn schema() -> Value {
    let mut schema = of_table(&decode::table());
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Scene of winkler");
    schema
}

fn of_table(table: &Table) -> Value {
    let keys = || table.keys.iter().filter(|key| !key.about.is_empty());
    let property = |key: &super::shape::Key| {
        let mut value = of(&key.form);
        value["description"] = json!(key.about);
        (key.name.to_owned(), value)
    };
    let properties: serde_json::Map<_, _> = keys().map(property).collect();
    let required: Vec<&str> = keys().filter(|key| key.must).map(|key| key.name).collect();
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    if !table.apart.is_empty() {
        schema["allOf"] = table.apart.iter().map(|pair| json!({ "not": { "required": pair } })).collect();
    }
    schema
}

fn of(form: &Form) -> Value {
    match form {
        Form::Text => json!({ "type": "string" }),
        Form::Flag => json!({ "type": "boolean" }),
        Form::Number => json!({ "type": "number" }),
        Form::Whole => json!({ "type": "integer", "minimum": 0 }),
        Form::Count => json!({ "type": "integer", "minimum": 1 }),
        Form::Among(numbers) => json!({ "enum": numbers }),
        Form::Field => json!({ "type": ["number", "string"] }),
        Form::Word(words) => json!({ "enum": words }),
        Form::List(item) => json!({ "type": "array", "items": of(item) }),
        Form::Table(table) => of_table(table),
        Form::Named(value) => json!({ "type": "object", "additionalProperties": of(value) }),
        Form::Either(forms) => json!({ "anyOf": forms.iter().map(of).collect::<Vec<_>>() }),
    }
}

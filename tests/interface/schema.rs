//! The JSON schema of scenes holds for every scene of the project, and refuses what the decoder refuses.

use crate::common::{root, winkler};
use jsonschema::Validator;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn validator(schema: &Value) -> Validator {
    jsonschema::validator_for(schema).expect("a schema")
}

fn parsed(text: &str) -> Option<Value> {
    serde_json::to_value(text.parse::<toml::Table>().ok()?).ok()
}

fn complaints(validator: &Validator, scene: &Value) -> Vec<String> {
    validator.iter_errors(scene).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

/// All scene files of the project.
fn scenes() -> Vec<PathBuf> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for path in fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                collect(&path, found);
            } else if path.extension().is_some_and(|end| end == "toml") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    collect(&root().join("meshes"), &mut found);
    collect(&root().join("src/commands/new"), &mut found);
    assert!(found.len() > 30, "{found:?}");
    found
}

#[test]
fn every_scene_fits_the_schema() {
    let printed = winkler(&["schema"]);
    let schema: Value = serde_json::from_str(&printed.stdout).expect("JSON");
    assert_eq!(schema, winkler::internals::scene::schema());
    let validator = validator(&schema);
    for path in scenes() {
        let scene = parsed(&fs::read_to_string(&path).expect("a scene")).expect("TOML");
        let wrong = complaints(&validator, &scene);
        assert!(wrong.is_empty(), "{}: {}", path.display(), wrong.join("\n"));
    }
}

/// Pieces of scenes in the documents have no key and no value that scenes do not have.
#[test]
fn the_pieces_in_the_documents_fit_the_schema() {
    fn without_required(schema: &mut Value) {
        match schema {
            Value::Object(map) => {
                if map.get("required").is_some_and(Value::is_array) && map.contains_key("properties") {
                    map.remove("required");
                }
                map.values_mut().for_each(without_required);
            }
            Value::Array(items) => items.iter_mut().for_each(without_required),
            _ => {}
        }
    }
    let mut schema = winkler::internals::scene::schema();
    without_required(&mut schema);
    let validator = validator(&schema);
    let mut seen = 0;
    for name in ["scene-file.md", "meshes.md", "surfaces.md", "recipes.md", "troubleshooting.md"] {
        let text = fs::read_to_string(root().join("docs").join(name)).expect(name);
        for block in text.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()) {
            // a few lines for one table, or several variants of a key, are no scene
            let Some(scene) = parsed(block) else { continue };
            if scene.as_object().is_none_or(|map| !map.keys().all(|key| schema["properties"].get(key).is_some())) {
                continue;
            }
            let wrong = complaints(&validator, &scene);
            assert!(wrong.is_empty(), "{name}: {block}\n{}", wrong.join("\n"));
            seen += 1;
        }
    }
    assert!(seen > 8, "{seen}");
}

/// Paths of all keys and values, but those of tables whose keys are names.
fn paths(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(map) if !path.ends_with("/set") => {
            for (key, value) in map {
                let path = format!("{path}/{key}");
                paths(value, &path, found);
                found.push(path);
            }
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(k, item)| paths(item, &format!("{path}/{k}"), found))
        }
        _ => {}
    }
}

/// Each key of a scene, misspelt or with a value of another kind, is refused by the schema as by the program.
#[test]
fn the_schema_refuses_what_the_program_refuses() {
    let validator = validator(&winkler::internals::scene::schema());
    let mut tried = 0;
    for name in ["groove", "flange", "coating", "bearing"] {
        let folder = root().join("meshes").join(name);
        let scene = parsed(&fs::read_to_string(folder.join("scene.toml")).expect("a scene")).expect("TOML");
        let refused = |scene: &Value, what: &str| {
            let text = toml::to_string(&scene).expect("TOML");
            let program = winkler::internals::scene::parse(&folder.join("scene.toml"), text, &[]).is_err();
            assert_eq!((program, !validator.is_valid(scene)), (true, true), "{name}: {what}");
        };
        let mut found = Vec::new();
        paths(&scene, "", &mut found);
        for path in found {
            let (parent, key) = path.rsplit_once('/').expect("a path");
            let mut misspelt = scene.clone();
            let table = misspelt.pointer_mut(parent).and_then(Value::as_object_mut).expect("a table");
            let value = table.remove(key).expect("a key");
            table.insert(format!("{key}x"), value);
            refused(&misspelt, &format!("{path} misspelt"));
            let mut other = scene.clone();
            *other.pointer_mut(&path).expect("a value") = serde_json::json!([[true]]);
            refused(&other, &format!("{path} = [[true]]"));
            tried += 1;
        }
    }
    assert!(tried > 100, "{tried}");
}

/// Collects each key of a table of the schema, and of the tables below it: name of the table, key, description.
fn keys<'a>(schema: &'a Value, table: &str, found: &mut Vec<(String, &'a str, &'a str)>) {
    for (key, property) in schema["properties"].as_object().into_iter().flatten() {
        found.push((table.to_owned(), key, property["description"].as_str().expect("a description")));
        keys(property, key, found);
        keys(&property["items"], key, found);
        keys(&property["additionalProperties"], key, found);
        property["anyOf"].as_array().into_iter().flatten().for_each(|kind| keys(kind, key, found));
    }
}

/// The page of the scene file has a row for every key, in the section of its table, with the default that the program has.
#[test]
fn the_page_has_every_key_with_its_default() {
    let schema = winkler::internals::scene::schema();
    let mut found = Vec::new();
    keys(&schema, "Top level", &mut found);
    let page = fs::read_to_string(root().join("docs/scene-file.md")).expect("the page");
    let mut defaults = 0;
    for (table, key, description) in found {
        let section =
            page.split("\n## ").find(|section| section.lines().next().is_some_and(|line| line.contains(&table)));
        // tables without a section are shown in rows of the table around them
        let named = if section.is_some() { 1 } else { usize::MAX };
        let has_key = |cell: &&str| cell.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == key);
        let lines = section.unwrap_or(&page).lines().filter(|line| line.starts_with('|'));
        let rows = lines.map(|line| line.split(" | ").collect::<Vec<_>>());
        let rows: Vec<_> = rows.filter(|row| row.iter().take(named).any(has_key)).collect();
        assert!(!rows.is_empty(), "docs/scene-file.md has no row for `{key}` of {table}");
        let default = description.rsplit_once("; ").map_or("", |(_, last)| last);
        // forms of values in braces have no column of defaults
        let described = rows.iter().find(|row| row.len() > 3 && row[0].contains(&format!("`{key}`")));
        if let (Some(row), Ok(_)) = (described, serde_json::from_str::<Value>(default)) {
            assert!(row[2].contains(default), "docs/scene-file.md: `{key}` has the default {default}, not {}", row[2]);
            defaults += 1;
        }
    }
    assert!(defaults > 25, "{defaults}");
}

//! The JSON schema of scenes has every key of every scene of the project, and none that is not a key.

use crate::common::{root, winkler};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// All scene files of the project.
fn scenes() -> Vec<PathBuf> {
    let is_scene = |path: &PathBuf| path.extension().is_some_and(|end| end == "toml");
    let files = |folder: &Path| fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path());
    let folders = files(&root().join("meshes")).chain([root().join("src/commands/new")]);
    let found: Vec<PathBuf> =
        folders.filter(|path| path.is_dir()).flat_map(|folder| files(&folder)).filter(is_scene).collect();
    assert!(found.len() > 30, "{found:?}");
    found
}

/// Return the schemas of the forms that a value may have.
fn forms(schema: &Value) -> Vec<&Value> {
    let inner = schema["anyOf"].as_array().into_iter().flatten().flat_map(forms);
    std::iter::once(schema).chain(inner).collect()
}

/// Return the place of the first key that no form of the schema has.
fn unknown<'a>(scene: &toml::Value, schemas: &[&'a Value], place: &str) -> Option<String> {
    match scene {
        toml::Value::Table(table) => table.iter().find_map(|(key, value)| {
            let known = |schema: &&'a Value| schema["properties"].get(key).or(schema.get("additionalProperties"));
            let below: Vec<&Value> =
                schemas.iter().filter_map(known).flat_map(forms).filter(|form| form.is_object()).collect();
            let place = format!("{place}/{key}");
            if below.is_empty() { Some(place) } else { unknown(value, &below, &place) }
        }),
        toml::Value::Array(items) => {
            let below: Vec<&Value> = schemas.iter().filter_map(|schema| schema.get("items")).flat_map(forms).collect();
            items.iter().find_map(|item| unknown(item, &below, place))
        }
        _ => None,
    }
}

#[test]
fn every_key_of_every_scene_is_in_the_schema() {
    let printed = winkler(&["schema"]);
    let schema: Value = serde_json::from_str(&printed.stdout).expect("JSON");
    assert_eq!(schema, winkler::internals::scene::schema());
    for path in scenes() {
        let text = fs::read_to_string(&path).expect("a scene");
        let scene: toml::Table = text.parse().expect("TOML");
        assert_eq!(unknown(&scene.into(), &forms(&schema), ""), None, "{}", path.display());
    }
    let wrong: toml::Table = "[[body]]\nyoug = 1".parse().expect("TOML");
    assert_eq!(unknown(&wrong.into(), &forms(&schema), ""), Some("/body/youg".to_owned()));
}

/// The `toml` blocks of the manual, whole scenes and pieces of a body, a contact or a method, have only keys of a scene.
#[test]
fn every_key_of_the_manual_is_in_the_schema() {
    let schema = winkler::internals::scene::schema();
    let top = forms(&schema);
    let below = |key: &str| -> Vec<&Value> {
        let found: Vec<&Value> = top.iter().filter_map(|form| form["properties"].get(key)).flat_map(forms).collect();
        found.iter().filter_map(|form| form.get("items")).flat_map(forms).chain(found.clone()).collect()
    };
    let places = [top.clone(), below("body"), below("contact"), below("method")];
    let pages = fs::read_dir(root().join("docs")).expect("a folder").flatten().map(|entry| entry.path());
    let is_page = |path: &PathBuf| path.extension().is_some_and(|end| end == "md");
    let mut tried = 0;
    for page in pages.filter(is_page).chain([root().join("README.md")]) {
        let text = fs::read_to_string(&page).expect("a page");
        for block in text.split("```toml\n").skip(1).filter_map(|rest| rest.split_once("```")) {
            let table: toml::Table = block.0.parse().unwrap_or_else(|cause| panic!("{}: {cause}", page.display()));
            let table = toml::Value::from(table);
            let lost: Vec<String> = places.iter().filter_map(|place| unknown(&table, place, "")).collect();
            assert!(lost.len() < places.len(), "{}: {} in\n{}", page.display(), lost.join(", "), block.0);
            tried += 1;
        }
    }
    assert!(tried > 15, "{tried} blocks");
}

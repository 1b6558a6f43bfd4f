//! What varies between the runs of `sweep` and `bench`: axes, and the combinations of their values.

use crate::error::{Error, Kind, Result};

/// What varies between runs.
pub struct SweepAxis {
    pub name: String,
    /// Values in the order of the runs.
    pub choices: Vec<AxisValue>,
}

/// A value of an axis, and what it means for a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AxisValue {
    /// Its text in the table.
    pub text: String,
    pub overrides: Vec<String>,
    pub petsc: Vec<String>,
}

impl AxisValue {
    /// Return a value that overrides keys of the scene.
    pub fn of_scene(text: impl Into<String>, overrides: Vec<String>) -> Self {
        Self { text: text.into(), overrides, petsc: Vec::new() }
    }
}

impl SweepAxis {
    /// Return an axis.
    pub fn new(name: &str, choices: Vec<AxisValue>) -> Self {
        Self { name: name.to_owned(), choices }
    }

    /// Read the axes of `--over KEY=V1,V2,...`.
    pub fn all_over(typed: &[String]) -> Result<Vec<Self>> {
        typed.iter().map(|text| Self::over(text)).collect()
    }

    /// Read `KEY=V1,V2,...`. Commas inside brackets, braces, parentheses or quotes do not separate values.
    fn over(text: &str) -> Result<Self> {
        let refuse = || {
            Error::new(Kind::Usage, format!("`--over {text}` is not KEY=V1,V2,..."))
                .help("for example --over method.gamma=0.3,0.6,0.9")
        };
        let (key, list) = text.split_once('=').ok_or_else(refuse)?;
        let (key, values) = (key.trim(), split(list));
        if key.is_empty() || values.iter().any(|value| value.trim().is_empty()) {
            return Err(refuse());
        }
        let choice = |value: &String| AxisValue::of_scene(value.trim(), vec![format!("{key}={}", value.trim())]);
        Ok(Self::new(key, values.iter().map(choice).collect()))
    }
}

/// Split a list at its commas.
fn split(list: &str) -> Vec<String> {
    let mut values = vec![String::new()];
    let (mut depth, mut quote) = (0, None);
    for c in list.chars() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            (None, '[' | '{' | '(') => depth += 1,
            (None, ']' | '}' | ')') => depth -= 1,
            (None, ',') if depth == 0 => {
                values.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(value) = values.last_mut() {
            value.push(c);
        }
    }
    values
}

/// Return all combinations with one choice of each axis; those of the last axis change first.
pub fn combinations(axes: &[SweepAxis]) -> Vec<Vec<&AxisValue>> {
    axes.iter().fold(vec![Vec::new()], |combinations, SweepAxis { choices, .. }| {
        combinations
            .iter()
            .flat_map(|before| choices.iter().map(move |choice| [before.clone(), vec![choice]].concat()))
            .collect()
    })
}

/// Return a value with the last word of its key, or with the whole key where two of the `keys` have the same last word.
pub fn named(key: &str, value: &str, keys: &[String]) -> String {
    let last = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
    let is_ambiguous = keys.iter().filter(|other| last(other) == last(key)).count() > 1;
    format!("{} = {value}", if is_ambiguous { key.to_owned() } else { last(key) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_split_at_commas_outside_brackets_and_all_combinations_made() {
        let texts = |axis: &SweepAxis| axis.choices.iter().map(|choice| choice.text.clone()).collect::<Vec<_>>();
        let a = SweepAxis::over("method.gamma=0.3, 0.6").expect("two numbers");
        assert_eq!((a.name.as_str(), texts(&a)), ("method.gamma", vec!["0.3".to_owned(), "0.6".to_owned()]));
        assert_eq!(a.choices[1].overrides, ["method.gamma=0.6"]);
        let b = SweepAxis::over("contact.0.gap=\"max(x, 1)\",0").expect("an expression and a number");
        assert_eq!(texts(&b), ["\"max(x, 1)\"", "0"]);
        assert!(SweepAxis::over("method.gamma").is_err() && SweepAxis::over("method.gamma=1,,2").is_err());
        let axes = [a, b];
        let runs = combinations(&axes);
        assert_eq!(runs.len(), 4);
        assert_eq!(runs[1].iter().map(|choice| choice.text.as_str()).collect::<Vec<_>>(), ["0.3", "0"]);
    }
}

//! The plan of `sweep` and `bench`: axes with values, and a case for each combination of them.

use crate::error::{Error, Kind, Result};
use crate::output::tables::Cell;
use std::path::PathBuf;

/// What varies between cases.
pub struct CaseAxis {
    /// Name of its column.
    pub name: String,
    /// Values in the order of the cases.
    pub values: Vec<AxisValue>,
}

/// A value of an axis, and what it means for a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AxisValue {
    /// Its text in the table.
    pub text: String,
    /// Overrides of the scene.
    pub overrides: Vec<String>,
    /// PETSc options.
    pub petsc: Vec<String>,
}

/// A combination of a value of each axis.
#[derive(Debug, Clone)]
pub struct Case {
    /// Scene file.
    pub scene: PathBuf,
    /// The texts of the values, in the order of the axes.
    pub key: Vec<String>,
    /// The values that differ between the cases of the plan, in words.
    pub label: String,
    /// Overrides of the scene.
    pub overrides: Vec<String>,
    /// PETSc options.
    pub petsc: Vec<String>,
}

/// All cases of a command.
pub struct CasePlan {
    /// Names of the axes.
    pub columns: Vec<String>,
    /// The combinations; the values of the last axis change first.
    pub cases: Vec<Case>,
}

impl AxisValue {
    /// Return a value that overrides keys of the scene.
    pub fn new(text: impl Into<String>, overrides: Vec<String>) -> Self {
        Self { text: text.into(), overrides, petsc: Vec::new() }
    }
}

impl CaseAxis {
    /// Return an axis.
    pub fn new(name: &str, values: Vec<AxisValue>) -> Self {
        Self { name: name.to_owned(), values }
    }

    /// Read `KEY=V1,V2,...` of `--over`. Commas inside brackets, braces, parentheses or quotes do not separate values.
    ///
    /// # Errors
    /// Another text.
    pub fn over(text: &str) -> Result<Self> {
        let refuse = || {
            Error::new(Kind::Usage, format!("`--over {text}` is not KEY=V1,V2,..."))
                .help("for example --over method.gamma=0.3,0.6,0.9")
        };
        let (key, list) = text.split_once('=').ok_or_else(refuse)?;
        let (key, values) = (key.trim(), split(list));
        if key.is_empty() || values.iter().any(|value| value.trim().is_empty()) {
            return Err(refuse());
        }
        let value = |value: &String| AxisValue::new(value.trim(), vec![format!("{key}={}", value.trim())]);
        Ok(Self::new(key, values.iter().map(value).collect()))
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
        values.last_mut().into_iter().for_each(|value| value.push(c));
    }
    values
}

impl CasePlan {
    /// Return a plan without cases.
    pub fn new(columns: Vec<String>) -> Self {
        Self { columns, cases: Vec::new() }
    }

    /// Add all combinations of the axes of a scene, whose names are the columns. Overrides and PETSc options for all
    /// cases come before those of the values.
    pub fn add(&mut self, scene: PathBuf, axes: &[CaseAxis], overrides: &[String], petsc: &[String]) {
        let first = Case { scene, key: vec![], label: String::new(), overrides: overrides.into(), petsc: petsc.into() };
        let with = |case: &Case, value: &AxisValue| Case {
            key: [&case.key[..], std::slice::from_ref(&value.text)].concat(),
            overrides: [&case.overrides[..], &value.overrides].concat(),
            petsc: [&case.petsc[..], &value.petsc].concat(),
            ..case.clone()
        };
        let all = axes.iter().fold(vec![first], |cases, axis| {
            cases.iter().flat_map(|case| axis.values.iter().map(|value| with(case, value))).collect()
        });
        self.cases.extend(all);
    }

    /// Return the value of a column.
    pub fn value<'a>(&self, case: &'a Case, column: &str) -> &'a str {
        let place = self.columns.iter().position(|name| name == column);
        place.map_or("", |place| &case.key[place])
    }

    /// Return the values of a case as fields of a table.
    pub fn fields(&self, case: &Case) -> impl Iterator<Item = Cell> {
        self.columns.iter().cloned().zip(case.key.iter().cloned())
    }

    /// Return the columns that differ between some keys.
    pub fn varied<'a>(&self, keys: impl Iterator<Item = &'a Vec<String>> + Clone) -> Vec<usize> {
        let differs = |&column: &usize| {
            let mut values = keys.clone().map(|key| &key[column]);
            let first = values.next();
            values.any(|value| Some(value) != first)
        };
        (0..self.columns.len()).filter(differs).collect()
    }

    /// Give every case its label from the columns that differ within the plan, or without any from the `usual` one.
    pub fn label_cases(&mut self, usual: usize) {
        let mut shown = self.varied(self.cases.iter().map(|case| &case.key));
        if shown.is_empty() {
            shown.push(usual);
        }
        let labels: Vec<String> = self.cases.iter().map(|case| self.label(&case.key, &shown)).collect();
        self.cases.iter_mut().zip(labels).for_each(|(case, label)| case.label = label);
    }

    /// Return the values of some columns of a key in words.
    pub fn label(&self, key: &[String], columns: &[usize]) -> String {
        columns.iter().map(|&column| self.part(column, &key[column])).collect::<Vec<_>>().join(", ")
    }

    /// Return a value with the last word of its column, or with the whole name where two columns have the same last
    /// word. Scenes, solvers and methods need no name.
    fn part(&self, column: usize, value: &str) -> String {
        let name = &self.columns[column];
        let last = |name: &str| name.rsplit('.').next().unwrap_or(name).to_owned();
        match name.as_str() {
            "scene" | "solver" | "asked" => value.to_owned(),
            "order" => format!("P{value}"),
            "ranks" => format!("{value} ranks"),
            _ if self.columns.iter().filter(|other| last(other) == last(name)).count() > 1 => {
                format!("{name} = {value}")
            }
            _ => format!("{} = {value}", last(name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_split_at_commas_outside_brackets_and_all_combinations_made() {
        let texts = |axis: &CaseAxis| axis.values.iter().map(|value| value.text.clone()).collect::<Vec<_>>();
        let a = CaseAxis::over("method.gamma=0.3, 0.6").expect("two numbers");
        assert_eq!((a.name.as_str(), texts(&a)), ("method.gamma", vec!["0.3".to_owned(), "0.6".to_owned()]));
        let b = CaseAxis::over("contact.0.gap=\"max(x, 1)\",0").expect("an expression and a number");
        assert_eq!(texts(&b), ["\"max(x, 1)\"", "0"]);
        assert!(CaseAxis::over("method.gamma").is_err() && CaseAxis::over("method.gamma=1,,2").is_err());
        let mut plan = CasePlan::new([&a, &b].map(|axis| axis.name.clone()).to_vec());
        plan.add("scene.toml".into(), &[a, b], &["x=1".to_owned()], &[]);
        plan.label_cases(0);
        assert_eq!(plan.cases.len(), 4);
        assert_eq!(plan.cases[1].overrides, ["x=1", "method.gamma=0.3", "contact.0.gap=0"]);
        assert_eq!(plan.cases[1].label, "gamma = 0.3, gap = 0");
        assert_eq!(plan.value(&plan.cases[2], "method.gamma"), "0.6");
    }
}

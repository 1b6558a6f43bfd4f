//! Filters of the templates, which format values of a report for people.

use crate::output::trimmed;
use minijinja::value::{Rest, ValueKind};
use minijinja::{Environment, Value};

/// Return an environment of templates with the filters `num`, `words` and `without`.
pub fn environment() -> Environment<'static> {
    let mut environment = Environment::new();
    environment.add_filter("num", number);
    environment.add_filter("words", words);
    environment.add_filter("without", without);
    environment
}

/// Format a number with five digits; other values become a dash.
fn number(value: &Value) -> String {
    let Ok(value) = f64::try_from(value.clone()) else { return "–".to_owned() };
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-3..1e6).contains(&size) => {
            let text = format!("{value:.3e}");
            let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{}e{power}", trimmed(digits)).replace('-', "−")
        }
        size => {
            let digits = (4.0 - size.log10().floor()).clamp(0.0, 7.0) as usize;
            trimmed(&format!("{value:.digits$}")).replace('-', "−")
        }
    }
}

/// Format a table as `key = value, ...` and a list as `(a, b)`, with the numbers of [`number`].
fn words(value: &Value) -> String {
    let list = || value.try_iter().into_iter().flatten();
    match value.kind() {
        ValueKind::Map => {
            let item = |key: Value| {
                let item = value.get_item(&key).unwrap_or_default();
                match item.kind() {
                    ValueKind::Map => format!("{key}: {}", words(&item)),
                    _ => format!("{key} = {}", words(&item)),
                }
            };
            list().map(item).collect::<Vec<_>>().join(", ")
        }
        ValueKind::Seq => format!("({})", list().map(|item| words(&item)).collect::<Vec<_>>().join(", ")),
        ValueKind::Number => number(value),
        ValueKind::Bool => if value.is_true() { "true" } else { "false" }.to_owned(),
        _ => value.to_string(),
    }
}

/// Return a table without some of its keys.
fn without(value: &Value, keys: Rest<String>) -> Value {
    let kept =
        value.try_iter().into_iter().flatten().filter(|key| !keys.iter().any(|other| key.as_str() == Some(other)));
    kept.map(|key| (key.to_string(), value.get_item(&key).unwrap_or_default())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short() {
        let number = |value: f64| number(&Value::from(value));
        assert_eq!(
            [0.0, 1.0, 93.108797, -5e-7, 2.1e5, 1e6, 0.05].map(number),
            ["0", "1", "93.109", "−5e−7", "210000", "1e6", "0.05"]
        );
        assert_eq!(super::number(&Value::from(())), "–");
        assert_eq!(words(&Value::from(false)), "false");
        let value = Value::from_serialize(serde_json::json!({ "power": { "B": 1e-3, "a": 0.5 }, "at": [1, 2.5] }));
        assert_eq!(words(&without(&value, Rest(vec!["at".into()]))), "power: B = 0.001, a = 0.5");
        assert_eq!(words(&value.get_attr("at").unwrap()), "(1, 2.5)");
    }
}

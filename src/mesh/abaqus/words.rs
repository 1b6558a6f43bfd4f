//! The words of keywords and data lines.

use super::lines::At;
use crate::mesh::fortran::real;
use crate::mesh::frame::Coordinates;

/// A result with a message in words.
pub type TextResult<T> = std::result::Result<T, String>;

/// A keyword with its parameters.
pub struct Keyword {
    /// The keyword in capitals.
    pub name: String,
    parameters: Vec<(String, String)>,
    /// Its line.
    pub at: At,
}

impl Keyword {
    /// Read a line without its star.
    pub fn new(line: &str, at: At) -> Self {
        let mut words = line.split(',').map(str::trim);
        let name = words.next().unwrap_or_default().to_ascii_uppercase();
        let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
        let pair = |word: &str| {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            (key.trim().to_ascii_uppercase(), value.trim().to_owned())
        };
        Self { name, parameters: words.map(pair).collect(), at }
    }

    /// Return the value of a parameter, which may be empty.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }
}

/// Return a name of the file in small letters.
pub fn spelled(word: &str) -> String {
    word.trim().trim_matches('"').to_ascii_lowercase()
}

/// Return a number of a node or element.
pub fn count(word: &str) -> TextResult<u64> {
    word.trim().parse().map_err(|_| format!("`{}` is no number", word.trim()))
}

/// Return the numbers of a data line. Empty ones are zero.
pub fn reals(words: &[&str]) -> TextResult<Vec<f64>> {
    let number = |word: &&str| match word.is_empty() {
        true => Ok(0.0),
        false => real(word).ok_or_else(|| format!("`{word}` is no number")),
    };
    words.iter().map(number).collect()
}

/// Return the kind of coordinates of `*NODE`.
pub fn coordinates(keyword: &Keyword) -> TextResult<Coordinates> {
    match keyword.get("SYSTEM").unwrap_or("R").to_ascii_uppercase().as_str() {
        "R" => Ok(Coordinates::Rectangular),
        "C" => Ok(Coordinates::Cylindrical),
        other => {
            Err(format!("nodes with SYSTEM={other} are not read: give rectangular (R) or cylindrical (C) coordinates"))
        }
    }
}

/// Return first and last number and step of a data line that generates a set. A file of so many `bytes` has no more of them.
pub fn generated(set: &str, words: &[&str], bytes: usize) -> TextResult<[u64; 3]> {
    let [first, last] = [count(words[0])?, count(words.get(1).copied().unwrap_or(words[0]))?];
    let step = words.get(2).filter(|word| !word.is_empty()).map_or(Ok(1), |word| count(word))?.max(1);
    match last.saturating_sub(first) / step >= bytes as u64 {
        true => Err(format!("the set `{set}` has more members, from {first} to {last}, than the file has bytes")),
        false => Ok([first, last, step]),
    }
}

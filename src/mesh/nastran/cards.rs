//! Entries of bulk data: a name, and fields over one or more lines.

use std::ops::Range;

/// An entry.
pub struct Card {
    /// Its name in capitals, without the mark of wide fields.
    pub name: String,
    /// The fields behind the name: eight for each line, or four wide ones. Missing ones are empty.
    pub fields: Vec<String>,
    /// Its lines in the file, from 0.
    pub lines: Range<usize>,
}

impl Card {
    /// Return a field, which is empty if the entry ends before.
    pub fn field(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }
}

/// Return the entries whose name is `wanted`.
pub fn cards(lines: &[&str], wanted: impl Fn(&str) -> bool) -> Vec<Card> {
    let mut cards: Vec<Card> = Vec::new();
    let mut is_open = false;
    for (number, line) in lines.iter().enumerate() {
        let line = line.split('$').next().unwrap_or_default();
        if line.trim().is_empty() {
            continue;
        }
        let (name, fields) = fields(line);
        let continues = name.is_empty() || name.starts_with(['+', '*']);
        match cards.last_mut().filter(|_| continues && is_open) {
            Some(card) => {
                card.fields.extend(fields);
                card.lines.end = number + 1;
            }
            None => {
                let name = name.trim_end_matches('*').to_ascii_uppercase();
                is_open = !continues && wanted(&name);
                if is_open {
                    cards.push(Card { name, fields, lines: number..number + 1 });
                }
            }
        }
    }
    cards
}

/// Return the name of a line and its fields: eight, or four large ones. Missing ones are blank.
fn fields(line: &str) -> (String, Vec<String>) {
    let line = with_blanks(line);
    let cut = |from: usize, width: usize| line.chars().skip(from).take(width).collect::<String>().trim().to_owned();
    if line.contains(',') {
        let mut words = line.split(',').map(|word| word.trim().to_owned());
        let name = words.next().unwrap_or_default();
        let count = if name.ends_with('*') { 4 } else { 8 };
        return (name, words.chain(std::iter::repeat(String::new())).take(count).collect());
    }
    let name = cut(0, 8);
    let width = if name.contains('*') { 16 } else { 8 };
    let fields = (0..64 / width).map(|index| cut(8 + width * index, width)).collect();
    (name, fields)
}

/// Return a line with blanks in place of each tab, up to the next field.
fn with_blanks(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    for c in line.trim_end().chars() {
        match c {
            '\t' => text.extend(std::iter::repeat_n(' ', 8 - text.len() % 8)),
            c => text.push(c),
        }
    }
    text
}

/// Put a text in the place of some lines of a file.
pub fn replace(made: &mut [String], lines: Range<usize>, text: String) {
    made[lines.clone()].iter_mut().for_each(|line| line.clear());
    made[lines.start] = text;
}

//! Lists of names in sentences.

use crate::error::few;

/// Names of bodies as in a sentence.
pub fn in_words<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let mut names = few(names.map(|name| format!("`{name}`")));
    match names.pop() {
        Some(last) if !names.is_empty() => format!("{} and {last}", names.join(", ")),
        last => last.unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::in_words;

    #[test]
    fn long_lists_are_cut() {
        let names = |count: usize| (0..count).map(|i| format!("b{i}")).collect::<Vec<_>>();
        let said = |count: usize| in_words(names(count).iter());
        assert_eq!([said(0), said(1), said(3)], ["", "`b0`", "`b0`, `b1` and `b2`"]);
        assert!(said(13).ends_with("`b11` and `b12`"));
        assert!(said(4096).ends_with("`b11` and 4084 others"));
    }
}

//! The words of a Gmsh script, split as Gmsh itself splits them.

use std::ops::Range;

/// A word of a script, or a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Token<'a> {
    /// A name or a command.
    Name(&'a str),
    /// A quoted text, without its quotes.
    Text(&'a str),
    /// Any other character.
    Sign(char),
}

/// Return the names, quoted texts and other signs of a script, with the range of bytes where each stands. Comments and numbers
/// are omitted.
pub fn tokens(text: &str) -> Vec<(Range<usize>, Token<'_>)> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let mut push = |length: usize, token| {
            tokens.push((at..at + length, token));
            length
        };
        at += if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").map_or(rest.len(), |end| end + 4)
        } else if first == '"' || first == '\'' {
            let body = &rest[1..];
            let end = body.find(first).unwrap_or(body.len());
            push(rest.len().min(end + 2), Token::Text(&body[..end]))
        } else if first.is_ascii_alphabetic() || first == '_' {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
            push(end, Token::Name(&rest[..end]))
        } else if first.is_ascii_digit() {
            number(rest)
        } else if first.is_whitespace() {
            first.len_utf8()
        } else {
            push(first.len_utf8(), Token::Sign(first))
        };
    }
    tokens
}

/// Return the length of the number at the start of a text. A word may follow without a space, and Gmsh reads it as a separate
/// word.
fn number(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end += 1 + digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
        match digits(end + 1 + sign) {
            0 => {}
            exponent => end += 1 + sign + exponent,
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_end_where_gmsh_ends_them() {
        use Token::{Name, Sign, Text};
        let of = |text: &'static str| tokens(text).into_iter().map(|(_, token)| token).collect::<Vec<_>>();
        assert_eq!(of("a1 = 3Save 'x\"y'; // Print\n"), [Name("a1"), Sign('='), Name("Save"), Text("x\"y"), Sign(';')]);
        assert_eq!(of("1e-3 2.5E+7e 4..e /* \" */ \"open"), [Name("e"), Sign('.'), Name("e"), Text("open")]);
        assert_eq!(tokens("ä_b")[1].0, 2..4);
    }
}

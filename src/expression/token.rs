//! The tokens of an expression.

use super::operators::INFIX;
use super::text::Text;
use crate::error::Result;
use std::ops::Range;

/// A token of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// A binary operator, or one of `( ) , !`.
    Symbol(&'static str),
    End,
}

/// Return the token at or after the byte `start`, and its bytes in the text.
///
/// # Errors
/// Bytes that are no token.
pub(super) fn next<'a>(whole: &Text<'a>, start: usize) -> Result<(Token<'a>, Range<usize>)> {
    let text = whole.text;
    let start = text.len() - text[start..].trim_start().len();
    let rest = &text[start..];
    let Some(first) = rest.chars().next() else {
        return Ok((Token::End, start..start));
    };
    if first.is_ascii_digit() || first == '.' {
        let span = start..start + number_length(rest);
        return match text[span.clone()].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok((Token::Number(value), span)),
            Ok(_) => Err(whole.refuse(span, "the number is too large")),
            Err(_) => Err(whole.refuse(span, "not a number").help("write numbers like 2, 0.5 or 1e-3")),
        };
    }
    if first.is_alphabetic() || first == '_' {
        let length = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        return Ok((Token::Name(&rest[..length]), start..start + length));
    }
    let symbols = INFIX.iter().map(|(_, operator)| operator.name).chain(["(", ")", ",", "!"]);
    match symbols.filter(|symbol| rest.starts_with(symbol)).max_by_key(|symbol| symbol.len()) {
        Some("*") if rest.starts_with("**") => {
            Err(whole.refuse(start..start + 2, "unknown operator `**`").help("write a power as x^2"))
        }
        Some(symbol) => Ok((Token::Symbol(symbol), start..start + symbol.len())),
        None => {
            let error = whole.refuse(start..start + first.len_utf8(), format!("unexpected `{first}`"));
            Err(match first {
                '=' => error.help("compare with =="),
                '&' => error.help("\"and\" is written &&"),
                '|' => error.help("\"or\" is written ||, an absolute value abs(x)"),
                _ => error,
            })
        }
    }
}

/// Return the length in bytes of the number with which `rest` starts: digits, a point, an exponent.
fn number_length(rest: &str) -> usize {
    let digits = |from: usize| rest[from..].bytes().take_while(|b| b.is_ascii_digit() || *b == b'.').count();
    let mantissa = digits(0);
    let exponent = &rest[mantissa..];
    if !exponent.starts_with(['e', 'E']) {
        return mantissa;
    }
    let sign = usize::from(exponent[1..].starts_with(['+', '-']));
    match exponent[1 + sign..].bytes().take_while(u8::is_ascii_digit).count() {
        0 => mantissa,
        count => mantissa + 1 + sign + count,
    }
}

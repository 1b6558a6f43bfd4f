//! The parser of expressions: tokens, operator precedence, function calls, and refusals with their place.
//!
//! Steps are written in postfix order while the tokens are read, so that the cost is proportional to the length of the
//! text.

use super::program::{self, BINARY, Binary, COMPARISON, INFIX, Number, Operation, POWER, SIGN, SIGNS, UNARY, Unary};
use crate::data::{Data, Library};
use crate::error::{Error, Place, Result, nearest};
use std::ops::{Range, RangeInclusive};

/// Largest depth of nesting, which bounds the recursion of the parser.
const DEEPEST: usize = 60;

/// Parse a whole text into steps.
///
/// # Errors
/// Texts that are no expression, and data that cannot be read.
pub(super) fn parse(text: Text, scope: KnownNames) -> Result<Vec<Operation>> {
    let (token, span) = next(&text, 0)?;
    if token == Token::End {
        return Err(text.refuse(0..text.text.len(), "the expression is empty"));
    }
    let mut parser = Parser { text, scope, token, span, depth: 0, code: Vec::new() };
    parser.expression(0)?;
    match parser.token {
        Token::End => Ok(parser.code),
        Token::Symbol(")") => Err(text.refuse(parser.span, "`)` without `(`")),
        Token::Symbol(",") => Err(text
            .refuse(parser.span, "`,` outside a function")
            .help("a decimal point is a point; commas part the values of a function: max(x, y)")),
        _ => Err(parser.missing_operator()),
    }
}

struct Parser<'a> {
    text: Text<'a>,
    scope: KnownNames<'a>,
    token: Token<'a>,
    /// The bytes of the next token in the text.
    span: Range<usize>,
    depth: usize,
    /// The steps so far.
    code: Vec<Operation>,
}

impl<'a> Parser<'a> {
    /// Read the next token. Return the token before it, with its bytes.
    fn step(&mut self) -> Result<(Token<'a>, Range<usize>)> {
        let (token, span) = next(&self.text, self.span.end)?;
        Ok((std::mem::replace(&mut self.token, token), std::mem::replace(&mut self.span, span)))
    }

    /// Parse operands that are joined by operators with at least the binding power `least`.
    fn expression(&mut self, least: u8) -> Result<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.text.refuse(self.span.clone(), "the expression is nested too deeply"));
        }
        self.operand()?;
        let mut has_comparison = false;
        while let Token::Symbol(symbol) = self.token
            && let Some((power, operator)) = INFIX.iter().find(|(_, known)| known.name == symbol)
            && *power >= least
        {
            let (_, span) = self.step()?;
            if *power == COMPARISON && std::mem::replace(&mut has_comparison, true) {
                return Err(self.text.refuse(span, "comparisons do not chain").help("write 0 < x && x < 1"));
            }
            self.expression(if *power == POWER { SIGN } else { power + 1 })?;
            self.apply_two(operator);
        }
        self.depth -= 1;
        Ok(())
    }

    /// Parse a number, a variable, a call, a parenthesis, or one of these with a sign.
    fn operand(&mut self) -> Result<()> {
        let (token, span) = self.step()?;
        match token {
            Token::Number(value) => {
                self.code.push(Operation::Number(value));
                Ok(())
            }
            Token::Name(name) if self.token == Token::Symbol("(") => self.call(name, span),
            Token::Name(name) => self.variable(name, span),
            Token::Symbol("(") => {
                self.expression(0)?;
                self.close(&span)
            }
            Token::Symbol("+") => self.expression(SIGN),
            Token::Symbol(symbol) => {
                let sign = SIGNS.iter().find(|sign| sign.name == symbol);
                let sign = sign.ok_or_else(|| self.text.refuse(span, format!("expected a value before `{symbol}`")))?;
                self.expression(SIGN)?;
                self.apply_one(sign);
                Ok(())
            }
            Token::End => {
                // the last character may be a blank of several bytes
                let last = self.text.text.char_indices().next_back().map_or(0, |(at, _)| at);
                Err(self
                    .text
                    .refuse(last..self.text.text.len(), "the expression stops short")
                    .help("after this a number, a variable or a function is missing"))
            }
        }
    }

    /// Parse the arguments of a function whose name was read. The next token is `(`.
    fn call(&mut self, name: &str, span: Range<usize>) -> Result<()> {
        let unary = UNARY.iter().find(|known| known.name == name);
        let binary = BINARY.iter().find(|known| known.name == name);
        let data = self.scope.data.get(name).cloned();
        let arguments = match (unary, binary, &data) {
            (Some(_), ..) => 1..=1,
            (_, Some(Binary { name: "min" | "max", .. }), _) => 2..=usize::MAX,
            (_, Some(_), _) => 2..=2,
            (.., Some(data)) => {
                data.load()?;
                data.arguments()..=data.arguments()
            }
            _ => return Err(self.unknown_function(name, span)),
        };
        let (_, open) = self.step()?;
        let mut given = 0;
        if self.token != Token::Symbol(")") {
            loop {
                self.expression(0)?;
                given += 1;
                // `min` and `max` of many values are applied to two values at a time
                if let Some(function) = binary.filter(|_| given > 1 && arguments.contains(&given)) {
                    self.apply_two(function);
                }
                if self.token != Token::Symbol(",") {
                    break;
                }
                self.step()?;
            }
        }
        self.close(&open)?;
        if !arguments.contains(&given) {
            return Err(self.miscounted(name, &arguments, given, data.as_deref(), span));
        }
        match (unary, data) {
            (Some(function), _) => self.apply_one(function),
            (None, Some(data)) if binary.is_none() => self.code.push(Operation::Data(data)),
            _ => {}
        }
        Ok(())
    }

    /// Apply an operator to the last value. A number is replaced by the result at once.
    fn apply_one(&mut self, function: &'static Unary) {
        match self.code.last_mut() {
            Some(Operation::Number(value)) => *value = value.one(function),
            _ => self.code.push(Operation::Unary(function)),
        }
    }

    /// Apply an operator to the last two values. Two numbers are replaced by the result at once.
    fn apply_two(&mut self, function: &'static Binary) {
        match self.code[..] {
            [.., Operation::Number(left), Operation::Number(right)] => {
                self.code.truncate(self.code.len() - 2);
                self.code.push(Operation::Number(left.two(right, function)));
            }
            _ => self.code.push(Operation::Binary(function)),
        }
    }

    /// Parse a variable, or `pi`.
    fn variable(&mut self, name: &str, span: Range<usize>) -> Result<()> {
        if name == "pi" {
            self.code.push(Operation::Number(std::f64::consts::PI));
            return Ok(());
        }
        if let Some(place) = self.scope.variables.iter().position(|known| *known == name) {
            self.code.push(Operation::Variable(place));
            return Ok(());
        }
        if let Some(factor) = self.scope.factors.iter().position(|known| known == name) {
            self.code.push(Operation::Factor(factor));
            return Ok(());
        }
        if self.functions().any(|known| known == name) {
            return Err(self
                .text
                .refuse(span, format!("`{name}` needs its value in parentheses"))
                .help(format!("write {name}(...)")));
        }
        let error = self.text.refuse(span, format!("unknown variable `{name}`")).label("not known here");
        Err(match name {
            "and" => error.help("\"and\" is written &&"),
            "or" => error.help("\"or\" is written ||"),
            "not" => error.help("\"not\" is written !"),
            _ => error.help(self.known()),
        })
    }

    /// Return the refusal of a call whose name is no function.
    fn unknown_function(&self, name: &str, span: Range<usize>) -> Error {
        if self.scope.variables.contains(&name) || name == "pi" {
            return self.text.refuse(span, format!("`{name}` is not a function")).help("write `*` to multiply");
        }
        let error = self.text.refuse(span, format!("unknown function `{name}`")).label("not known here");
        match (name, nearest(name, self.functions())) {
            ("ln", _) => error.help("the natural logarithm is log(x)"),
            (_, Some(known)) => error.help(format!("did you mean `{known}`?")),
            (_, None) => error.help(self.known()),
        }
    }

    /// Return the list of all names that an expression may use, for a message.
    fn known(&self) -> String {
        let functions: Vec<_> = self.functions().collect();
        let factors = self.scope.factors.iter().map(String::as_str);
        let variables: Vec<_> = self.scope.variables.iter().copied().chain(factors).collect();
        format!("known are {}, pi, and the functions {}", variables.join(", "), functions.join(", "))
    }

    /// Read the parenthesis that closes the one at `open`.
    fn close(&mut self, open: &Range<usize>) -> Result<()> {
        match self.token {
            Token::Symbol(")") => self.step().map(|_| ()),
            Token::End => Err(self.text.refuse(open.clone(), "`(` is never closed")),
            Token::Symbol(",") => Err(self.text.refuse(self.span.clone(), "`,` outside a function")),
            _ => Err(self.missing_operator()),
        }
    }

    /// Return the refusal of a value that follows another without an operator. After a number it may be meant as a
    /// unit.
    fn missing_operator(&self) -> Error {
        let found = &self.text.text[self.span.clone()];
        let is_after_number =
            self.text.text[..self.span.start].trim_end().ends_with(|c: char| c.is_ascii_digit() || c == '.');
        let is_unit = found.starts_with(char::is_alphabetic)
            && !self.scope.variables.contains(&found)
            && found != "pi"
            && !self.functions().any(|known| known == found);
        if is_after_number && is_unit {
            return self
                .text
                .refuse(self.span.clone(), format!("`{found}` is neither a variable nor an operator"))
                .help(
                    "numbers stand without their unit: choose units that fit each other, and give every value in them",
                );
        }
        self.text
            .refuse(self.span.clone(), format!("expected an operator before `{found}`"))
            .help("write `*` to multiply")
    }

    fn functions(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let data = self.scope.data.keys().map(String::as_str);
        program::functions().map(|name| -> &'a str { name }).chain(data)
    }

    /// Return the refusal of a call with too few values, or too many.
    fn miscounted(
        &self,
        name: &str,
        arguments: &RangeInclusive<usize>,
        given: usize,
        data: Option<&Data>,
        span: Range<usize>,
    ) -> Error {
        let least = *arguments.start();
        let more = if *arguments.end() > 2 { " or more" } else { "" };
        let plural = if least == 1 { "" } else { "s" };
        let error = self.text.refuse(span, format!("`{name}` takes {least}{more} value{plural}, not {given}"));
        match data {
            None => error,
            Some(_) if least == 1 => {
                error.help("its file is a profile, heights along one line: write the place along it")
            }
            Some(_) => error.help("its file is a surface: write the places along a row of the file and down its rows"),
        }
    }
}

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

/// A text, and the place of the string that contains it.
#[derive(Clone, Copy)]
pub(super) struct Text<'a> {
    pub text: &'a str,
    pub place: &'a Place,
}

impl Text<'_> {
    /// Return a refusal of some of its bytes. The caret is inside the string if the source has the text verbatim,
    /// without escapes.
    pub fn refuse(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        let Place { source, span: whole } = self.place;
        let written = source.text.get(whole.clone()).unwrap_or_default();
        let exact = written.find(self.text).filter(|_| !self.text.is_empty()).map(|offset| {
            let start = whole.start + offset;
            Place { source: source.clone(), span: start + span.start..start + span.end }
        });
        Error::scene(exact.as_ref().unwrap_or(self.place), message)
    }
}

/// The names that an expression can use besides the common functions and `pi`.
#[derive(Clone, Copy)]
pub struct KnownNames<'a> {
    /// Names of the variables, at most four.
    pub variables: &'a [&'static str],
    /// Names of the factors of the load steps.
    pub factors: &'a [String],
    /// Functions from files.
    pub data: &'a Library,
}

impl<'a> KnownNames<'a> {
    /// Return a scope of variables alone.
    pub fn of(variables: &'a [&'static str]) -> Self {
        static NONE: Library = Library::new();
        Self { variables, factors: &[], data: &NONE }
    }
}

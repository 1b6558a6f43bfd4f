//! Grammar of expressions: operator precedence, function calls, and where a slip stands.
//!
//! The steps come out in postfix order as the words are read, so that a long text costs no more than its length.

use super::operators::{self, BINARY, COMPARISON, INFIX, POWER, SIGN, UNARY};
use super::program::Code;
use super::scope::Scope;
use super::slip::Slip;
use super::token::{self, Token};
use crate::data::Data;
use crate::error::nearest;
use std::ops::Range;

/// Deepest nesting: it bounds the recursion here.
const DEEPEST: usize = 60;

/// Parses a whole text.
pub(super) fn parse(text: &str, scope: Scope) -> Result<Vec<Code>, Slip> {
    let (token, span) = token::next(text, 0)?;
    if token == Token::End {
        return Err(Slip::new(0..text.len(), "the expression is empty"));
    }
    let mut parser = Parser { text, scope, token, span, depth: 0, code: Vec::new() };
    parser.expression(0)?;
    match parser.token {
        Token::End => Ok(parser.code),
        Token::Symbol(")") => Err(Slip::new(parser.span, "`)` without `(`")),
        Token::Symbol(",") => Err(Slip::new(parser.span, "`,` outside a function")
            .help("a decimal point is a point; commas part the values of a function: max(x, y)")),
        _ => Err(parser.missing_operator()),
    }
}

struct Parser<'a> {
    text: &'a str,
    scope: Scope<'a>,
    token: Token<'a>,
    span: Range<usize>,
    depth: usize,
    code: Vec<Code>,
}

impl<'a> Parser<'a> {
    /// Moves on, and gives back the word left behind and its place.
    fn step(&mut self) -> Result<(Token<'a>, Range<usize>), Slip> {
        let (token, span) = token::next(self.text, self.span.end)?;
        Ok((std::mem::replace(&mut self.token, token), std::mem::replace(&mut self.span, span)))
    }

    /// Operands joined by operators that bind at least as tightly as `least`.
    fn expression(&mut self, least: u8) -> Result<(), Slip> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Slip::new(self.span.clone(), "the expression is nested too deeply"));
        }
        self.operand()?;
        let mut compared = false;
        while let Token::Symbol(symbol) = self.token
            && let Some((_, power, _)) = INFIX.iter().find(|(known, ..)| *known == symbol)
            && *power >= least
        {
            let (_, span) = self.step()?;
            if *power == COMPARISON && std::mem::replace(&mut compared, true) {
                return Err(Slip::new(span, "comparisons do not chain").help("write 0 < x && x < 1"));
            }
            self.expression(if *power == POWER { SIGN } else { power + 1 })?;
            self.apply_two(symbol);
        }
        self.depth -= 1;
        Ok(())
    }

    /// A number, a variable, a call, a parenthesis, or one of these with a sign.
    fn operand(&mut self) -> Result<(), Slip> {
        let (token, span) = self.step()?;
        match token {
            Token::Number(value) => {
                self.code.push(Code::Number(value));
                Ok(())
            }
            Token::Name(name) if self.token == Token::Symbol("(") => self.call(name, span),
            Token::Name(name) => self.variable(name, span),
            Token::Symbol("(") => {
                self.expression(0)?;
                self.close(&span)
            }
            Token::Symbol("+") => self.expression(SIGN),
            Token::Symbol(sign @ ("-" | "!")) => {
                self.expression(SIGN)?;
                self.apply_one(sign);
                Ok(())
            }
            Token::Symbol(symbol) => Err(Slip::new(span, format!("expected a value before `{symbol}`"))),
            Token::End => {
                // blanks may have several bytes
                let last = self.text.char_indices().next_back().map_or(0, |(at, _)| at);
                Err(Slip::new(last..self.text.len(), "the expression stops short")
                    .help("after this a number, a variable or a function is missing"))
            }
        }
    }

    /// A function of the values in parentheses; the name was read, `(` comes next.
    fn call(&mut self, name: &str, span: Range<usize>) -> Result<(), Slip> {
        let unary = UNARY.iter().find(|(known, _)| *known == name).map(|(known, _)| *known);
        let binary = BINARY.iter().find(|(known, _)| *known == name).map(|(known, _)| *known);
        let data = self.scope.data.get(name).cloned();
        let arguments = match (unary, binary, &data) {
            (Some(_), ..) => 1..=1,
            (_, Some("min" | "max"), _) => 2..=usize::MAX,
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
                // of many values the first two are one value before the third is read
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
            return Err(miscounted(name, *arguments.start(), *arguments.end() > 2, given, data.as_deref(), span));
        }
        match (unary, data) {
            (Some(function), _) => self.apply_one(function),
            (None, Some(data)) if binary.is_none() => self.code.push(Code::Data(data)),
            _ => {}
        }
        Ok(())
    }

    /// Applies an operator of one value to what was read last; of a number it makes a number.
    fn apply_one(&mut self, name: &'static str) {
        match (self.code.last_mut(), operators::unary(name)) {
            (Some(Code::Number(value)), Some(apply)) => *value = apply(*value),
            _ => self.code.push(Code::Unary(name)),
        }
    }

    /// Applies an operator to the last two values; of two numbers it makes one.
    fn apply_two(&mut self, name: &'static str) {
        match (&self.code[..], operators::binary(name)) {
            (&[.., Code::Number(left), Code::Number(right)], Some(apply)) => {
                self.code.truncate(self.code.len() - 2);
                self.code.push(Code::Number(apply(left, right)));
            }
            _ => self.code.push(Code::Binary(name)),
        }
    }

    fn variable(&mut self, name: &str, span: Range<usize>) -> Result<(), Slip> {
        if name == "pi" {
            self.code.push(Code::Number(std::f64::consts::PI));
            return Ok(());
        }
        if let Some(place) = self.scope.variables.iter().position(|known| *known == name) {
            self.code.push(Code::Variable(place));
            return Ok(());
        }
        if self.functions().any(|known| known == name) {
            return Err(
                Slip::new(span, format!("`{name}` needs its value in parentheses")).help(format!("write {name}(...)"))
            );
        }
        let slip = Slip::new(span, format!("unknown variable `{name}`")).label("not known here");
        Err(match name {
            "and" => slip.help("\"and\" is written &&"),
            "or" => slip.help("\"or\" is written ||"),
            "not" => slip.help("\"not\" is written !"),
            _ => slip.help(self.known()),
        })
    }

    fn unknown_function(&self, name: &str, span: Range<usize>) -> Slip {
        if self.scope.variables.contains(&name) || name == "pi" {
            return Slip::new(span, format!("`{name}` is not a function")).help("write `*` to multiply");
        }
        let slip = Slip::new(span, format!("unknown function `{name}`")).label("not known here");
        match (name, nearest(name, self.functions())) {
            ("ln", _) => slip.help("the natural logarithm is log(x)"),
            (_, Some(known)) => slip.help(format!("did you mean `{known}`?")),
            (_, None) => slip.help(self.known()),
        }
    }

    /// All names that an expression may use here.
    fn known(&self) -> String {
        let functions: Vec<_> = self.functions().collect();
        format!("known are {}, pi, and the functions {}", self.scope.variables.join(", "), functions.join(", "))
    }

    fn close(&mut self, open: &Range<usize>) -> Result<(), Slip> {
        match self.token {
            Token::Symbol(")") => self.step().map(|_| ()),
            Token::End => Err(Slip::new(open.clone(), "`(` is never closed")),
            Token::Symbol(",") => Err(Slip::new(self.span.clone(), "`,` outside a function")),
            _ => Err(self.missing_operator()),
        }
    }

    fn missing_operator(&self) -> Slip {
        let found = &self.text[self.span.clone()];
        let after_number = self.text[..self.span.start].trim_end().ends_with(|c: char| c.is_ascii_digit() || c == '.');
        let unit = found.starts_with(char::is_alphabetic)
            && !self.scope.variables.contains(&found)
            && found != "pi"
            && !self.functions().any(|known| known == found);
        if after_number && unit {
            return Slip::new(self.span.clone(), format!("`{found}` is neither a variable nor an operator")).help(
                "numbers stand without their unit: choose units that fit each other, and give every value in them",
            );
        }
        Slip::new(self.span.clone(), format!("expected an operator before `{found}`")).help("write `*` to multiply")
    }

    /// Names of all functions.
    fn functions(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let data = self.scope.data.keys().map(String::as_str);
        operators::functions().map(|name| -> &'a str { name }).chain(data)
    }
}

/// The refusal of a call with too few values, or too many.
fn miscounted(name: &str, wanted: usize, more: bool, given: usize, data: Option<&Data>, span: Range<usize>) -> Slip {
    let plural = if wanted == 1 && !more { "" } else { "s" };
    let more = if more { " or more" } else { "" };
    let slip = Slip::new(span, format!("`{name}` takes {wanted}{more} value{plural}, not {given}"));
    match data {
        None => slip,
        Some(_) if wanted == 1 => slip.help("its file is a profile, heights along one line: write the place along it"),
        Some(_) => slip.help("its file is a surface: write the places along a row of the file and down its rows"),
    }
}

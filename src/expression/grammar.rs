//! Grammar of expressions: operator precedence, function calls, and where a slip stands.
//!
//! `exmex` evaluates, but its parser reads -x^2 as (-x)^2, does not nest calls of `min` and `max`, and knows no
//! positions. So the grammar is ours, and `exmex` is handed a text in which every operation has parentheses
//! and `max(a, b)` is `(a max b)`.

use super::operators::{BINARY, COMPARISON, INFIX, POWER, SIGN, UNARY};
use super::slip::Slip;
use super::token::{self, Token};
use crate::error::nearest;
use std::ops::Range;

/// Deepest nesting (it bounds the recursion here), and most operations.
const DEEPEST: usize = 60;
const LONGEST: usize = 500;

/// Parses a whole text and gives it back in the form for `exmex`.
pub(super) fn parse(text: &str, variables: &[&'static str]) -> Result<String, Slip> {
    let (token, span) = token::next(text, 0)?;
    if token == Token::End {
        return Err(Slip::new(0..text.len(), "the expression is empty"));
    }
    let mut parser = Parser { text, variables, token, span, depth: 0, operations: 0 };
    let tree = parser.expression(0)?;
    match parser.token {
        Token::End => Ok(tree),
        Token::Symbol(")") => Err(Slip::new(parser.span, "`)` without `(`")),
        Token::Symbol(",") => Err(Slip::new(parser.span, "`,` outside a function")
            .help("a decimal point is a point; commas part the values of a function: max(x, y)")),
        _ => Err(parser.missing_operator()),
    }
}

struct Parser<'a> {
    text: &'a str,
    variables: &'a [&'static str],
    token: Token<'a>,
    span: Range<usize>,
    depth: usize,
    operations: usize,
}

impl<'a> Parser<'a> {
    /// Moves on, and gives back the word left behind and its place.
    fn step(&mut self) -> Result<(Token<'a>, Range<usize>), Slip> {
        let (token, span) = token::next(self.text, self.span.end)?;
        Ok((std::mem::replace(&mut self.token, token), std::mem::replace(&mut self.span, span)))
    }

    /// Operands joined by operators that bind at least as tightly as `least`.
    fn expression(&mut self, least: u8) -> Result<String, Slip> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Slip::new(self.span.clone(), "the expression is nested too deeply"));
        }
        let mut left = self.operand()?;
        let mut compared = false;
        while let Token::Symbol(symbol) = self.token
            && let Some((_, power, _)) = INFIX.iter().find(|(known, ..)| *known == symbol)
            && *power >= least
        {
            let (_, span) = self.step()?;
            if *power == COMPARISON && std::mem::replace(&mut compared, true) {
                return Err(Slip::new(span, "comparisons do not chain").help("write 0 < x && x < 1"));
            }
            let right = self.expression(if *power == POWER { SIGN } else { power + 1 })?;
            left = self.made(format!("({left} {symbol} {right})"), &span)?;
        }
        self.depth -= 1;
        Ok(left)
    }

    /// A number, a variable, a call, a parenthesis, or one of these with a sign.
    fn operand(&mut self) -> Result<String, Slip> {
        let (token, span) = self.step()?;
        match token {
            // Display writes all digits and no exponent, which `exmex` would not read.
            Token::Number(value) => Ok(value.to_string()),
            Token::Name(name) if self.token == Token::Symbol("(") => self.call(name, span),
            Token::Name(name) => self.variable(name, span),
            Token::Symbol("(") => {
                let inner = self.expression(0)?;
                self.close(&span)?;
                Ok(inner)
            }
            Token::Symbol("+") => self.expression(SIGN),
            Token::Symbol(sign @ ("-" | "!")) => {
                let operand = self.expression(SIGN)?;
                self.made(format!("({sign}({operand}))"), &span)
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
    fn call(&mut self, name: &str, span: Range<usize>) -> Result<String, Slip> {
        let unary = UNARY.iter().find(|(known, _)| *known == name).map(|(known, _)| *known);
        let binary = BINARY.iter().find(|(known, _)| *known == name).map(|(known, _)| *known);
        let Some(function) = unary.or(binary) else {
            return Err(self.unknown_function(name, span));
        };
        let (_, open) = self.step()?;
        let mut values = Vec::new();
        if self.token != Token::Symbol(")") {
            values.push(self.expression(0)?);
            while self.token == Token::Symbol(",") {
                self.step()?;
                values.push(self.expression(0)?);
            }
        }
        self.close(&open)?;
        let wanted = match function {
            "min" | "max" => "2 or more values",
            _ if binary.is_some() => "2 values",
            _ => "1 value",
        };
        let fits = match wanted {
            "1 value" => values.len() == 1,
            "2 values" => values.len() == 2,
            _ => values.len() >= 2,
        };
        if !fits {
            return Err(Slip::new(span, format!("`{name}` takes {wanted}, not {}", values.len())));
        }
        if unary.is_some() {
            return self.made(format!("({function}({}))", values[0]), &span);
        }
        let mut result = values[0].clone();
        for value in &values[1..] {
            result = self.made(format!("({result} {function} {value})"), &span)?;
        }
        Ok(result)
    }

    fn variable(&self, name: &str, span: Range<usize>) -> Result<String, Slip> {
        if name == "pi" {
            return Ok(std::f64::consts::PI.to_string());
        }
        if self.variables.contains(&name) {
            return Ok(name.to_owned());
        }
        if functions().any(|known| known == name) {
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
        if self.variables.contains(&name) || name == "pi" {
            return Slip::new(span, format!("`{name}` is not a function")).help("write `*` to multiply");
        }
        let slip = Slip::new(span, format!("unknown function `{name}`")).label("not known here");
        match (name, nearest(name, functions())) {
            ("ln", _) => slip.help("the natural logarithm is log(x)"),
            (_, Some(known)) => slip.help(format!("did you mean `{known}`?")),
            (_, None) => slip.help(self.known()),
        }
    }

    /// All names that an expression may use here.
    fn known(&self) -> String {
        let functions: Vec<_> = functions().collect();
        format!("known are {}, pi, and the functions {}", self.variables.join(", "), functions.join(", "))
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
            && !self.variables.contains(&found)
            && found != "pi"
            && !functions().any(|known| known == found);
        if after_number && unit {
            return Slip::new(self.span.clone(), format!("`{found}` is neither a variable nor an operator")).help(
                "numbers stand without their unit: choose units that fit each other, and give every value in them",
            );
        }
        Slip::new(self.span.clone(), format!("expected an operator before `{found}`")).help("write `*` to multiply")
    }

    /// Counts an operation.
    fn made(&mut self, text: String, span: &Range<usize>) -> Result<String, Slip> {
        self.operations += 1;
        match self.operations <= LONGEST {
            true => Ok(text),
            false => Err(Slip::new(span.clone(), format!("the expression has more than {LONGEST} operations"))),
        }
    }
}

fn functions() -> impl Iterator<Item = &'static str> {
    UNARY.iter().map(|(name, _)| *name).chain(BINARY.iter().map(|(name, _)| *name))
}

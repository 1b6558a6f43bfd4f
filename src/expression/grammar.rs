//! The parser of expressions: operator precedence, function calls, and refusals with their place.
//!
//! Steps are written in postfix order while the tokens are read, so that the cost is proportional to the length of the text.

use super::operators::{self, BINARY, Binary, COMPARISON, INFIX, POWER, SIGN, SIGNS, UNARY, Unary};
use super::program::{Number, Step};
use super::scope::Scope;
use super::text::Text;
use super::token::{self, Token};
use crate::data::Data;
use crate::error::{Error, Result, nearest};
use std::ops::{Range, RangeInclusive};

/// Largest depth of nesting, which bounds the recursion of the parser.
const DEEPEST: usize = 60;

/// Parse a whole text into steps.
///
/// # Errors
/// Texts that are no expression, and data that cannot be read.
pub(super) fn parse(text: Text, scope: Scope) -> Result<Vec<Step>> {
    let (token, span) = token::next(&text, 0)?;
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

/// The state of the parser.
struct Parser<'a> {
    text: Text<'a>,
    scope: Scope<'a>,
    /// The next token.
    token: Token<'a>,
    /// The bytes of the next token in the text.
    span: Range<usize>,
    /// Depth of nesting.
    depth: usize,
    /// The steps so far.
    code: Vec<Step>,
}

impl<'a> Parser<'a> {
    /// Read the next token. Return the token before it, with its bytes.
    fn step(&mut self) -> Result<(Token<'a>, Range<usize>)> {
        let (token, span) = token::next(&self.text, self.span.end)?;
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
                self.code.push(Step::Number(value));
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
            (None, Some(data)) if binary.is_none() => self.code.push(Step::Data(data)),
            _ => {}
        }
        Ok(())
    }

    /// Apply an operator to the last value. A number is replaced by the result at once.
    fn apply_one(&mut self, function: &'static Unary) {
        match self.code.last_mut() {
            Some(Step::Number(value)) => *value = value.one(function),
            _ => self.code.push(Step::Unary(function)),
        }
    }

    /// Apply an operator to the last two values. Two numbers are replaced by the result at once.
    fn apply_two(&mut self, function: &'static Binary) {
        match self.code[..] {
            [.., Step::Number(left), Step::Number(right)] => {
                self.code.truncate(self.code.len() - 2);
                self.code.push(Step::Number(left.two(right, function)));
            }
            _ => self.code.push(Step::Binary(function)),
        }
    }

    /// Parse a variable, or `pi`.
    fn variable(&mut self, name: &str, span: Range<usize>) -> Result<()> {
        if name == "pi" {
            self.code.push(Step::Number(std::f64::consts::PI));
            return Ok(());
        }
        if let Some(place) = self.scope.variables.iter().position(|known| *known == name) {
            self.code.push(Step::Variable(place));
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
        format!("known are {}, pi, and the functions {}", self.scope.variables.join(", "), functions.join(", "))
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

    /// Return the refusal of a value that follows another without an operator. After a number it may be meant as a unit.
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

    /// Return the names of all functions.
    fn functions(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let data = self.scope.data.keys().map(String::as_str);
        operators::functions().map(|name| -> &'a str { name }).chain(data)
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

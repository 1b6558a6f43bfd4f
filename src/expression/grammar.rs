//! Grammar of expressions: operator precedence, function calls, and where a slip stands.
//!
//! The steps come out in postfix order as the words are read, so that a long text costs no more than its length.

use super::operators::{self, BINARY, Binary, COMPARISON, INFIX, POWER, SIGN, SIGNS, UNARY, Unary};
use super::program::{Number, Step};
use super::scope::Scope;
use super::text::Text;
use super::token::{self, Token};
use crate::data::Data;
use crate::error::{Error, Result, nearest};
use std::ops::Range;

/// Deepest nesting: it bounds the recursion here.
const DEEPEST: usize = 60;

/// Parses a whole text.
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

struct Parser<'a> {
    text: Text<'a>,
    scope: Scope<'a>,
    token: Token<'a>,
    span: Range<usize>,
    depth: usize,
    code: Vec<Step>,
}

impl<'a> Parser<'a> {
    /// Moves on, and gives back the word left behind and its place.
    fn step(&mut self) -> Result<(Token<'a>, Range<usize>)> {
        let (token, span) = token::next(&self.text, self.span.end)?;
        Ok((std::mem::replace(&mut self.token, token), std::mem::replace(&mut self.span, span)))
    }

    /// Operands joined by operators that bind at least as tightly as `least`.
    fn expression(&mut self, least: u8) -> Result<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.text.refuse(self.span.clone(), "the expression is nested too deeply"));
        }
        self.operand()?;
        let mut compared = false;
        while let Token::Symbol(symbol) = self.token
            && let Some((power, operator)) = INFIX.iter().find(|(_, known)| known.name == symbol)
            && *power >= least
        {
            let (_, span) = self.step()?;
            if *power == COMPARISON && std::mem::replace(&mut compared, true) {
                return Err(self.text.refuse(span, "comparisons do not chain").help("write 0 < x && x < 1"));
            }
            self.expression(if *power == POWER { SIGN } else { power + 1 })?;
            self.apply_two(operator);
        }
        self.depth -= 1;
        Ok(())
    }

    /// A number, a variable, a call, a parenthesis, or one of these with a sign.
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
                // blanks may have several bytes
                let last = self.text.text.char_indices().next_back().map_or(0, |(at, _)| at);
                Err(self
                    .text
                    .refuse(last..self.text.text.len(), "the expression stops short")
                    .help("after this a number, a variable or a function is missing"))
            }
        }
    }

    /// A function of the values in parentheses; the name was read, `(` comes next.
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
            return Err(self.miscounted(name, *arguments.start(), *arguments.end() > 2, given, data.as_deref(), span));
        }
        match (unary, data) {
            (Some(function), _) => self.apply_one(function),
            (None, Some(data)) if binary.is_none() => self.code.push(Step::Data(data)),
            _ => {}
        }
        Ok(())
    }

    /// Applies an operator of one value to what was read last; of a number it makes a number.
    fn apply_one(&mut self, function: &'static Unary) {
        match self.code.last_mut() {
            Some(Step::Number(value)) => *value = value.one(function),
            _ => self.code.push(Step::Unary(function)),
        }
    }

    /// Applies an operator to the last two values; of two numbers it makes one.
    fn apply_two(&mut self, function: &'static Binary) {
        match self.code[..] {
            [.., Step::Number(left), Step::Number(right)] => {
                self.code.truncate(self.code.len() - 2);
                self.code.push(Step::Number(left.two(right, function)));
            }
            _ => self.code.push(Step::Binary(function)),
        }
    }

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

    /// All names that an expression may use here.
    fn known(&self) -> String {
        let functions: Vec<_> = self.functions().collect();
        format!("known are {}, pi, and the functions {}", self.scope.variables.join(", "), functions.join(", "))
    }

    fn close(&mut self, open: &Range<usize>) -> Result<()> {
        match self.token {
            Token::Symbol(")") => self.step().map(|_| ()),
            Token::End => Err(self.text.refuse(open.clone(), "`(` is never closed")),
            Token::Symbol(",") => Err(self.text.refuse(self.span.clone(), "`,` outside a function")),
            _ => Err(self.missing_operator()),
        }
    }

    fn missing_operator(&self) -> Error {
        let found = &self.text.text[self.span.clone()];
        let after_number =
            self.text.text[..self.span.start].trim_end().ends_with(|c: char| c.is_ascii_digit() || c == '.');
        let unit = found.starts_with(char::is_alphabetic)
            && !self.scope.variables.contains(&found)
            && found != "pi"
            && !self.functions().any(|known| known == found);
        if after_number && unit {
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

    /// Names of all functions.
    fn functions(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let data = self.scope.data.keys().map(String::as_str);
        operators::functions().map(|name| -> &'a str { name }).chain(data)
    }

    /// The refusal of a call with too few values, or too many.
    fn miscounted(
        &self,
        name: &str,
        wanted: usize,
        more: bool,
        given: usize,
        data: Option<&Data>,
        span: Range<usize>,
    ) -> Error {
        let plural = if wanted == 1 && !more { "" } else { "s" };
        let more = if more { " or more" } else { "" };
        let error = self.text.refuse(span, format!("`{name}` takes {wanted}{more} value{plural}, not {given}"));
        match data {
            None => error,
            Some(_) if wanted == 1 => {
                error.help("its file is a profile, heights along one line: write the place along it")
            }
            Some(_) => error.help("its file is a surface: write the places along a row of the file and down its rows"),
        }
    }
}

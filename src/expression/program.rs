//! Expressions as programs for a stack of numbers: a loop over their steps, however long or deep the text is.

use crate::data::Data;
use std::sync::Arc;

/// Most variables that an expression can use at once.
pub(super) const MOST_VARIABLES: usize = 4;

/// Values of the variables.
pub(super) type Values<T> = [T; MOST_VARIABLES];

/// A step of an expression in postfix order, for any kind of number.
#[derive(Debug, Clone)]
pub(super) enum Code {
    Number(f64),
    /// By its place among the values.
    Variable(usize),
    /// An operator or a function of one value, by name.
    Unary(&'static str),
    /// One of two.
    Binary(&'static str),
    /// A function from a file, which takes as many values as it has arguments.
    Data(Arc<Data>),
}

/// What expressions count with: plain numbers, or pairs of a value and a slope.
pub(super) trait Number: Copy + Default + 'static {
    /// A constant.
    fn constant(value: f64) -> Self;
    /// The operator or function of one value that has a name.
    fn unary(name: &str) -> Option<fn(Self) -> Self>;
    /// The one of two.
    fn binary(name: &str) -> Option<fn(Self, Self) -> Self>;
    /// Value of data at a place.
    fn data(data: &Data, place: &[Self]) -> Self;
}

/// A step whose functions are found.
#[derive(Clone)]
enum Step<T> {
    Number(T),
    Variable(usize),
    Unary(fn(T) -> T),
    Binary(fn(T, T) -> T),
    Data(Arc<Data>),
}

/// An expression over one kind of number.
#[derive(Clone)]
pub(super) struct Program<T> {
    steps: Vec<Step<T>>,
    /// Numbers that the stack holds at most.
    depth: usize,
}

/// Numbers of a stack that needs no memory of its own; expressions of a usual size need less than ten.
const SHALLOW: usize = 16;

impl<T: Number> Program<T> {
    /// Finds the functions of a code; none if one is unknown or lacks its values.
    pub(super) fn link(code: &[Code]) -> Option<Self> {
        let (mut held, mut depth) = (0_usize, 0);
        let mut steps = Vec::with_capacity(code.len());
        for step in code {
            let (step, taken) = match step {
                Code::Number(value) => (Step::Number(T::constant(*value)), 0),
                Code::Variable(place) => (Step::Variable(*place), 0),
                Code::Unary(name) => (Step::Unary(T::unary(name)?), 1),
                Code::Binary(name) => (Step::Binary(T::binary(name)?), 2),
                Code::Data(data) => (Step::Data(data.clone()), data.arguments()),
            };
            held = held.checked_sub(taken)? + 1;
            depth = depth.max(held);
            steps.push(step);
        }
        (held == 1).then_some(Self { steps, depth })
    }

    /// The value for the values of the variables.
    pub(super) fn eval(&self, variables: &Values<T>) -> T {
        self.watched(variables, |_, _| {})
    }

    /// The same; `watch` sees each call of data with its place.
    fn watched(&self, variables: &Values<T>, watch: impl FnMut(&Arc<Data>, &[T])) -> T {
        match self.depth {
            ..=SHALLOW => self.run(variables, &mut [T::default(); SHALLOW], watch),
            depth => self.run(variables, &mut vec![T::default(); depth], watch),
        }
    }

    /// `watched` on a stack that is deep enough.
    fn run(&self, variables: &Values<T>, stack: &mut [T], mut watch: impl FnMut(&Arc<Data>, &[T])) -> T {
        let mut top = 0;
        for step in &self.steps {
            match step {
                Step::Number(value) => {
                    stack[top] = *value;
                    top += 1;
                }
                Step::Variable(place) => {
                    stack[top] = variables[*place];
                    top += 1;
                }
                Step::Unary(apply) => stack[top - 1] = apply(stack[top - 1]),
                Step::Binary(apply) => {
                    top -= 1;
                    stack[top - 1] = apply(stack[top - 1], stack[top]);
                }
                Step::Data(data) => {
                    let first = top - data.arguments();
                    watch(data, &stack[first..top]);
                    stack[first] = T::data(data, &stack[first..top]);
                    top = first + 1;
                }
            }
        }
        stack[0]
    }
}

impl Program<f64> {
    /// The first data that have no value at the place where they are asked for, and that place.
    pub(super) fn outside(&self, variables: &Values<f64>) -> Option<(Arc<Data>, Vec<f64>)> {
        let mut found = None;
        self.watched(variables, |data, place| {
            if found.is_none() && place.iter().all(|x| x.is_finite()) && data.sample(place).value.is_nan() {
                found = Some((data.clone(), place.to_vec()));
            }
        });
        found
    }

    /// All data that it asks.
    pub(super) fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        self.steps.iter().filter_map(|step| match step {
            Step::Data(data) => Some(data),
            _ => None,
        })
    }
}

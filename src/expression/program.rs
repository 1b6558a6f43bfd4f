//! Expressions as programs for a stack of numbers: a loop over their steps, however long or deep the text is.

use super::operators::{Binary, Two, Unary};
use crate::data::Data;
use std::sync::Arc;

/// Most variables that an expression can use at once.
pub(super) const MOST_VARIABLES: usize = 4;

/// Values of the variables.
pub(super) type Values<T> = [T; MOST_VARIABLES];

/// A step of an expression in postfix order.
#[derive(Debug, Clone)]
pub(super) enum Step {
    Number(f64),
    /// By its place among the values.
    Variable(usize),
    Unary(&'static Unary),
    Binary(&'static Binary),
    /// A function from a file, which takes as many values as it has arguments.
    Data(Arc<Data>),
}

/// What expressions count with: plain numbers, or pairs of a value and a slope.
pub(super) trait Number: Copy + Default {
    /// A constant.
    fn constant(value: f64) -> Self;
    /// A function of this one.
    fn one(self, function: &Unary) -> Self;
    /// A function of this one and another.
    fn two(self, other: Self, function: &Binary) -> Self;
    /// Value of data at a place.
    fn data(data: &Data, place: &[Self]) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn one(self, function: &Unary) -> Self {
        (function.value)(self)
    }

    fn two(self, other: Self, function: &Binary) -> Self {
        match function.kind {
            Two::Smooth(value, _) | Two::Truth(value) => value(self, other),
            Two::Pick(is_first) if is_first(self, other) => self,
            Two::Pick(_) => other,
        }
    }

    fn data(data: &Data, place: &[f64]) -> f64 {
        data.sample(place).value
    }
}

/// An expression, for any kind of number.
pub(super) struct Program {
    steps: Vec<Step>,
    /// Numbers that the stack holds at most.
    depth: usize,
}

/// Numbers of a stack that needs no memory of its own; expressions of a usual size need less than ten.
const SHALLOW: usize = 16;

impl Program {
    /// Of steps each of which finds its values.
    pub(super) fn new(steps: Vec<Step>) -> Self {
        let (mut held, mut depth) = (0, 0);
        for step in &steps {
            held = match step {
                Step::Number(_) | Step::Variable(_) => held + 1,
                Step::Unary(_) => held,
                Step::Binary(_) => held - 1,
                Step::Data(data) => held + 1 - data.arguments(),
            };
            depth = depth.max(held);
        }
        Self { steps, depth }
    }

    /// The value for the values of the variables.
    pub(super) fn eval<T: Number>(&self, variables: &Values<T>) -> T {
        self.watched(variables, |_, _| {})
    }

    /// The same; `watch` sees each call of data with its place.
    fn watched<T: Number>(&self, variables: &Values<T>, watch: impl FnMut(&Arc<Data>, &[T])) -> T {
        match self.depth {
            ..=SHALLOW => self.run(variables, &mut [T::default(); SHALLOW], watch),
            depth => self.run(variables, &mut vec![T::default(); depth], watch),
        }
    }

    /// `watched` on a stack that is deep enough.
    fn run<T: Number>(&self, variables: &Values<T>, stack: &mut [T], mut watch: impl FnMut(&Arc<Data>, &[T])) -> T {
        let mut top = 0;
        for step in &self.steps {
            match step {
                Step::Number(value) => {
                    stack[top] = T::constant(*value);
                    top += 1;
                }
                Step::Variable(place) => {
                    stack[top] = variables[*place];
                    top += 1;
                }
                Step::Unary(function) => stack[top - 1] = stack[top - 1].one(function),
                Step::Binary(function) => {
                    top -= 1;
                    stack[top - 1] = stack[top - 1].two(stack[top], function);
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

    /// The first data that have no value at the place where they are asked for, and that place.
    pub(super) fn outside(&self, variables: &Values<f64>) -> Option<(Arc<Data>, Vec<f64>)> {
        let mut found = None;
        self.watched(variables, |data, place: &[f64]| {
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

    /// The variables that it uses.
    pub(super) fn variables(&self) -> impl Iterator<Item = usize> {
        self.steps.iter().filter_map(|step| match step {
            Step::Variable(variable) => Some(*variable),
            _ => None,
        })
    }
}

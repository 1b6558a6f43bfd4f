//! Expressions as programs for a stack of numbers. The evaluation is a loop over steps, however long or deep the text is.

use super::operators::{Binary, Two, Unary};
use crate::data::Data;
use std::sync::Arc;

/// Largest number of variables of an expression.
pub(super) const MOST_VARIABLES: usize = 4;

/// Values of the variables.
pub(super) type Values<T> = [T; MOST_VARIABLES];

/// A step of an expression in postfix order.
#[derive(Debug, Clone)]
pub(super) enum Step {
    Number(f64),
    /// A variable, by its index among the values.
    Variable(usize),
    Unary(&'static Unary),
    Binary(&'static Binary),
    /// A function from a file, which takes as many values as it has arguments.
    Data(Arc<Data>),
}

/// The numbers for which expressions are evaluated: plain numbers, or pairs of a value and a derivative.
pub(super) trait Number: Copy + Default {
    /// Return a constant.
    fn constant(value: f64) -> Self;
    /// Return a function of this number.
    fn one(self, function: &Unary) -> Self;
    /// Return a function of this number and another.
    fn two(self, other: Self, function: &Binary) -> Self;
    /// Return the value of data at a place.
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

/// An expression as a sequence of steps.
pub(super) struct Program {
    steps: Vec<Step>,
    /// Largest number of values on the stack.
    depth: usize,
}

/// Size of a stack without an allocation. Expressions of a usual size need less than ten numbers.
const SHALLOW: usize = 16;

impl Program {
    /// Return the program of some steps. Every step must find its arguments on the stack.
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

    /// Return the value for given values of the variables.
    pub(super) fn eval<T: Number>(&self, variables: &Values<T>) -> T {
        self.eval_with(variables, |_, _| {})
    }

    /// Return the value, and call `watch` for each use of data with its place.
    fn eval_with<T: Number>(&self, variables: &Values<T>, watch: impl FnMut(&Arc<Data>, &[T])) -> T {
        match self.depth {
            ..=SHALLOW => self.run(variables, &mut [T::default(); SHALLOW], watch),
            depth => self.run(variables, &mut vec![T::default(); depth], watch),
        }
    }

    /// Return the value, with a stack that is deep enough.
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

    /// Return the first data that have no value at the place where they are needed, and that place.
    pub(super) fn outside(&self, variables: &Values<f64>) -> Option<(Arc<Data>, Vec<f64>)> {
        let mut found = None;
        self.eval_with(variables, |data, place: &[f64]| {
            if found.is_none() && place.iter().all(|x| x.is_finite()) && data.sample(place).value.is_nan() {
                found = Some((data.clone(), place.to_vec()));
            }
        });
        found
    }

    /// Return all data that it uses.
    pub(super) fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        self.steps.iter().filter_map(|step| match step {
            Step::Data(data) => Some(data),
            _ => None,
        })
    }

    /// Return the indices of the variables that it uses.
    pub(super) fn variables(&self) -> impl Iterator<Item = usize> {
        self.steps.iter().filter_map(|step| match step {
            Step::Variable(variable) => Some(*variable),
            _ => None,
        })
    }
}

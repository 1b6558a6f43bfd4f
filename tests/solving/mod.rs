//! Methods and solvers: one answer by each of them, and the work that each may take.

mod agree;
mod condensed;
mod counters;
mod histories;
mod interval;
mod many;
mod mechanisms;
mod methods;
mod robustness;
mod saturating;
mod steps;
mod stopping;

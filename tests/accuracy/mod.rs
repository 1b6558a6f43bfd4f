//! Answers against closed forms and known solutions.

mod axisymmetric;
mod cases;
mod elasticity;
mod layers;
mod manufactured;
mod space;
mod supports;
mod turning;
mod verification;

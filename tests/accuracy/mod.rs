//! Answers against closed forms and known solutions.

mod axisymmetric;
mod bonds;
mod cases;
mod elasticity;
mod heat;
mod layers;
mod manufactured;
mod memory;
mod obstacles;
mod preloads;
mod seals;
mod shear;
mod space;
mod supports;
mod turning;
mod verification;

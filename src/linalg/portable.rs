//! Powers, exponentials and the like with the same last digit on all processors.
//!
//! The C library has several versions of each function and chooses one for the processor. Every rank evaluates the laws of all contact points. On
//! processors of two kinds, ranks would decide differently near a tolerance, and wait for each other for ever.

pub use libm::{
    acos, asin, atan, atan2, cbrt, cos, cosh, exp, expm1, hypot, log, log1p, log2, log10, pow, sin, sinh, tan, tanh,
};

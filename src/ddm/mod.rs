//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! There are two loops, each one screen: that of the paper ([`robin`]), and Newton's method (`newton`). They work on
//! arrays over the contact points (compression, pressure, tangent, area) and on the bodies of a
//! [`Model`](crate::model::Model). They know no dimension, no element and no mesh. Where a function says nothing else,
//! its errors are failures of the solver library; not converging is a [`Status`].
//!
//! # The constants of Newton's method
//!
//! None of them changes a solution. In the order in which a run meets them:
//!
//! | constant | value | it decides | it comes from |
//! | --- | --- | --- | --- |
//! | `start::PROXIMAL` | 1e-9 | how far bodies go that nothing stops yet | lies between `TOLERANCE` and `PART` of `linalg` |
//! | `start::SEARCH` | 1e-3 | how well a line search is solved | any value below one serves |
//! | `start::MOST_STEPS` | 200 | when the automatic start gives up | random scenes take 20 at most |
//! | `layer::FOUNDATION` | 0.83, 1.19 | the stiffness of surfaces in the start | Hertz, and counted steps of spheres and cylinders |
//! | `layer::SLOPE` | 0.1 | rho of the first steps | counted steps of random scenes |
//! | `forcing::STAND_IN` | 1e-3 | springs in place of open contacts | a descent chooses the length of such steps |
//! | `newton::FIRST_STEP` | 0.1 | how well a first step from another solution is solved | counted steps of machine parts |
//! | `LinearStep::roughest` | 0.5 | how well every step is solved at least | Dembo, Eisenstat, Steihaug: any value below one converges |
//! | `forcing::DELAY` | 3 | over how many iterations pressures have to settle | counted iterations of 13 scenes |
//! | `step::HALVINGS` | 7 | the shortest step | counted steps of random scenes |
//! | `step::ARMIJO` | 1e-4 | by how much a step has to come nearer | the usual value |
//! | `newton::WHOLE_STEP` | 0.2 | when a descent ends | random scenes, none lost |
//! | `step::SHORTENED` | 2 | when laws are smoothed | counted steps of slender scenes |
//! | `step::AHEAD` | 100 | by how much, and when the path is lost | counted steps of peeling beams |
//! | `bound::EXACT` | 1.5e-8 | up to which imbalance a step is exact, and how large the squared error is near the solution | the root of epsilon |
//! | `newton::LOOK` | 0.5 | how well the last look at the equilibrium is solved | its size alone is wanted |
//! | `newton::UNSEEN` | 0.01 | when smoothing ends, and what lies on the laws | two digits more than were asked for |
//! | `stop::FALLS`, `NEAR_FALLS` | 0.9, 0.5 | what is progress far from the solution, and near it | random scenes, none lost |
//! | `stop::SEEN` | 1e-12 | which falls of F1 are no roundoff | a sum of a million terms |
//! | `stop::SAME` | 1e-6 | which errors are those of the same iterate | circles of steps in random scenes, equal to 1e-9 |
//! | `stop::PATIENCE` | 3 | how many steps without progress end a run | random scenes, none lost |
//! | `solve::TIMES` | 10 | how many tolerances of imbalance are no solution | the two norms differ by less |
//! | `linalg::DIGIT` | 0.1 | when roundoff leaves no result | no digit is left |

mod bound;
mod forcing;
pub mod gamma;
mod history;
mod newton;
pub mod robin;
mod solve;
mod start;
mod step;
mod stop;

pub use forcing::respond;
pub use history::{Observer, Outcome, Row, Silent};
pub use solve::{InitialGuess, Method, Solution, first_springs, solve};
pub use stop::Status;

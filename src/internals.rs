//! The items of private modules that integration tests and examples use. They change without notice.

pub use crate::interrupt::Interrupt;
pub use crate::linalg::bounds;

pub mod contact {
    //! Contact points and laws of layers.
    pub use crate::contact::{ContactPair, PressureBasis, Side, assemble, law, pieces};
}

pub mod ddm {
    //! The methods.
    pub use crate::ddm::Outcome;
}

pub mod expression {
    //! Numbers written as expressions.
    pub use crate::expression::{Expression, Field, KnownNames};
}

pub mod fem {
    //! Finite elements.
    pub use crate::fem::{EDGES, Elasticity, Facets, Frame, Space, assemble, cross, displacement, pad, surface};
}

pub mod mesh {
    //! Meshes.
    pub use crate::mesh::{Asked, Duty, Group, Mesh, MeshProducer, load, parse, unstructured};
}

pub mod model {
    //! The discrete problem.
    pub use crate::model::{DisplacementField, Model, field};
}

pub mod parallel {
    //! Ranks.
    pub use crate::parallel::launcher;
}

pub mod run {
    //! A run in stages.
    pub use crate::run::{build, iterate, report, results, set_up, stages};
}

pub mod scene {
    //! Scene files.
    pub use crate::scene::{parse, schema};
}

pub mod solver {
    //! PETSc options.
    pub use crate::solver::options;
}

//! One matrix of all bodies in place of those of the bodies.

/// K of all bodies, in the matrix that serves the linear step. The bodies then have no K of their own.
pub trait Joint {
    /// Return K v for every local body, from their states. Rigid motions contribute nothing, because they cause no strain. Collective.
    fn multiply(&mut self, states: &[Vec<f64>]) -> Vec<Vec<f64>>;
}

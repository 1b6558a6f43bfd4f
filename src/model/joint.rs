//! One matrix of all bodies in place of theirs.

/// K of all bodies in the one matrix that serves the linear step: the bodies have none of their own.
pub trait Joint {
    /// K v in every body that lives here, for their states; nothing for rigid motions, which strain nothing. Collective.
    fn multiply(&mut self, states: &[Vec<f64>]) -> Vec<Vec<f64>>;
}

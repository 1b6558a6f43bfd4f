//! Integers and flags of the libraries, each of which has its own width.
//!
//! PETSc has [`Int`](super::Int), 32 or 64 bits as it was configured. MUMPS has [`MumpsInt`](super::ffi::MumpsInt), which is mostly 32 bits beside
//! either PETSc. METIS has one of two widths, which it shows when it is loaded. Patterns of this program have 32 bits.

use super::ffi::PetscBool;
use crate::error::{Error, Kind, Result};

/// Return a count as an integer of a `library`; the message names what is counted.
///
/// Larger numbers of an object are checked once, so that the smaller ones may be converted without a check.
///
/// # Errors
/// When the integers of the library have too few bits.
pub(super) fn fit<T: TryFrom<usize>>(library: &str, what: &str, count: usize) -> Result<T> {
    T::try_from(count).map_err(|_| {
        let bits = 8 * size_of::<T>();
        Error::new(
            Kind::Solver,
            format!("{count} {what} do not fit into the integers of {library}, which have {bits} bits"),
        )
        .help("take a coarser mesh, or more ranks")
    })
}

/// Return a flag of PETSc: C's bool from PETSc 3.24 on, before that an enumeration.
#[allow(clippy::useless_conversion)]
pub(super) fn flag(value: bool) -> PetscBool {
    value.into()
}

/// Return whether a flag of PETSc is set.
pub(super) fn is_set(flag: PetscBool) -> bool {
    flag != self::flag(false)
}

#[cfg(test)]
mod tests {
    use super::fit;

    #[test]
    fn numbers_that_do_not_fit_are_refused_in_words() {
        assert_eq!(fit::<i32>("MUMPS", "dofs", i32::MAX as usize).expect("it fits"), i32::MAX);
        assert_eq!(fit::<i64>("PETSc", "dofs", 1 << 31).expect("it fits"), 1 << 31);
        let error = fit::<i32>("MUMPS", "dofs", 1 << 31).expect_err("it does not fit");
        assert!(error.message().contains("2147483648 dofs do not fit into the integers of MUMPS, which have 32 bits"));
    }
}

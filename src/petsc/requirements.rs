//! Requirements on the installed PETSc, checked by the texts of its headers.
//!
//! `build.rs` includes this file, so that it refuses an unsuitable PETSc with a message before anything is compiled. The crate compiles it
//! for its unit tests.

/// The major and minor number of the oldest PETSc that has all functions that the binding calls.
pub const OLDEST: (u32, u32) = (3, 18);

/// The advice of every refusal. Debian's package has real numbers in double precision, MUMPS and hypre.
pub const ADVICE: &str = "point PETSC_DIR and PETSC_ARCH at one that has all of real numbers in double precision, \
                          MUMPS and hypre (Debian: petsc-dev; scripts/setup lists what else it takes)";

/// Return whether `petscconf.h` defines `name`.
fn defines(petscconf: &str, name: &str) -> bool {
    petscconf.lines().any(|line| {
        let mut words = line.split_whitespace();
        words.next() == Some("#define") && words.next() == Some(name)
    })
}

/// Return whether the PETSc of this `petscconf.h` has hypre. Without it, multigrid is PETSc's own (GAMG).
pub fn has_hypre(petscconf: &str) -> bool {
    defines(petscconf, "PETSC_HAVE_HYPRE")
}

/// Check the text of `petscconf.h` for real numbers, double precision, MPI and MUMPS.
///
/// # Errors
/// A sentence that names what is wrong and what to install.
pub fn check_config(petscconf: &str) -> Result<(), String> {
    let wrong = if defines(petscconf, "PETSC_USE_COMPLEX") {
        "this PETSc computes with complex numbers, but winkler needs one with real numbers"
    } else if !defines(petscconf, "PETSC_USE_REAL_DOUBLE") {
        "this PETSc does not compute in double precision, but winkler needs one that does"
    } else if defines(petscconf, "PETSC_HAVE_MPIUNI") {
        "this PETSc was built without MPI, but winkler needs one with MPI"
    } else if !defines(petscconf, "PETSC_HAVE_MUMPS") {
        "this PETSc was built without MUMPS, but winkler needs one with MUMPS"
    } else {
        return Ok(());
    };
    Err(format!("{wrong}: {ADVICE}"))
}

/// Check the text of `petscversion.h` against [`OLDEST`].
///
/// # Errors
/// A sentence that names the version found and the version needed.
pub fn check_version(petscversion: &str) -> Result<(), String> {
    let number = |name: &str| {
        petscversion.lines().find_map(|line| {
            let mut words = line.split_whitespace();
            let found = words.next() == Some("#define") && words.next() == Some(name);
            found.then(|| words.next()?.parse::<u32>().ok()).flatten()
        })
    };
    let (Some(major), Some(minor)) = (number("PETSC_VERSION_MAJOR"), number("PETSC_VERSION_MINOR")) else {
        return Err(format!("petscversion.h of this PETSc does not tell its version: {ADVICE}"));
    };
    if (major, minor) < OLDEST {
        let (a, b) = OLDEST;
        return Err(format!("this PETSc is {major}.{minor}, but winkler needs {a}.{b} or newer: {ADVICE}"));
    }
    Ok(())
}

/// Return the sentence with which PETSc's headers refuse an `mpi.h` that is not of the MPI that PETSc was built with, if clang reports it.
/// The headers compare kind and version of the two.
pub fn mix_of_mpi(said: &str) -> Option<&str> {
    let at = said.find("PETSc was configured with")?;
    said[at..].lines().next().map(|line| line.trim_end_matches(['"', '\'']))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "#define PETSC_HAVE_HYPRE 1\n#define PETSC_HAVE_MUMPS 1\n#define PETSC_USE_REAL_DOUBLE 1\n\
                        #define PETSC_HAVE_C99_COMPLEX 1\n/* #define PETSC_USE_COMPLEX 1 */\n";

    #[test]
    fn a_suitable_petsc_passes() {
        assert_eq!(check_config(GOOD), Ok(()));
        let without = GOOD.replace("HAVE_HYPRE", "HAVE_HYPREX");
        assert!(has_hypre(GOOD) && !has_hypre(&without) && check_config(&without).is_ok());
    }

    #[test]
    fn each_shortcoming_has_its_own_sentence() {
        let refusals = [
            (format!("{GOOD}#define PETSC_USE_COMPLEX 1\n"), "complex"),
            (GOOD.replace("REAL_DOUBLE", "REAL_SINGLE"), "double precision"),
            (format!("{GOOD}#define PETSC_HAVE_MPIUNI 1\n"), "without MPI"),
            (GOOD.replace("HAVE_MUMPS", "HAVE_MUMPSX"), "without MUMPS"),
        ];
        for (text, words) in refusals {
            let refusal = check_config(&text).expect_err(words);
            assert!(refusal.contains(words), "{refusal}");
            assert!(refusal.contains("petsc-dev"), "{refusal}");
        }
    }

    #[test]
    fn the_version_is_compared_by_numbers() {
        let text = |major: u32, minor: u32| {
            format!("#define PETSC_VERSION_MAJOR      {major}\n#define PETSC_VERSION_MINOR      {minor}\n")
        };
        assert_eq!(check_version(&text(3, 18)), Ok(()));
        assert_eq!(check_version(&text(3, 100)), Ok(()));
        assert_eq!(check_version(&text(4, 0)), Ok(()));
        assert!(check_version(&text(3, 9)).is_err_and(|refusal| refusal.contains("3.9")));
        assert!(check_version("").is_err());
    }

    #[test]
    fn a_mix_of_two_mpis_is_found_in_what_clang_says() {
        let said = "petscsys.h:99:6: error: \"PETSc was configured with OpenMPI but now\"\npetscsys.h:100:1: error: unknown type\n";
        assert_eq!(mix_of_mpi(said), Some("PETSc was configured with OpenMPI but now"));
        assert_eq!(mix_of_mpi("mpi.h:1:10: error: 'x.h' file not found"), None);
    }
}

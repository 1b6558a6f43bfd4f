//! The option names that PETSc knows, read from its own help texts.
//!
//! PETSc has no list of its options; each object tells its own when it reads them with `-help` on. So solvers are made
//! for a tiny matrix, under a prefix of their own, and what they print is read. Set-up belongs to it, for nested objects
//! tell theirs then (MUMPS, blocks, multigrid levels).

use crate::error::Result;
use crate::petsc::{Entry, Int, Ksp, Matrix, Session, printed};
use std::cell::Cell;
use std::collections::BTreeSet;

/// Krylov methods that serve a symmetric positive definite matrix or at least start on it.
pub(super) const METHODS: &str = "richardson chebyshev cg groppcg pipecg pipecgrr pipelcg pipeprcg pipecg2 cgne nash stcg gltr fcg \
    pipefcg gmres pipefgmres fgmres lgmres dgmres pgmres tcqmr bcgs ibcgs qmrcgs fbcgs fbcgsr bcgsl pipebcgs cgs tfqmr \
    cr pipecr lsqr preonly bicg minres symmlq lcd gcr pipegcr tsirm cgls";

/// Preconditioners, and for some a second option that leads to more options.
pub(super) const PRECONDITIONERS: &str = "none jacobi pbjacobi vpbjacobi sor eisenstat ilu icc bjacobi asm gasm mg gamg redundant ksp \
    svd kaczmarz telescope composite fieldsplit \
    hypre:hypre_type=boomeramg hypre:hypre_type=euclid hypre:hypre_type=parasails hypre:hypre_type=pilut ml \
    lu:factor_mat_solver_type=petsc cholesky:factor_mat_solver_type=petsc lu:factor_mat_solver_type=mumps \
    cholesky:factor_mat_solver_type=mumps lu:factor_mat_solver_type=superlu lu:factor_mat_solver_type=superlu_dist \
    lu:factor_mat_solver_type=umfpack cholesky:factor_mat_solver_type=cholmod lu:factor_mat_solver_type=klu";

/// Options that objects read without telling so in their help.
const SILENT: &str = "mat_type mat_view mat_no_inode mat_inode_limit mat_product_algorithm matmatmult_via matptap_via vec_type \
    vec_view ksp_converged_reason";

/// The option names of solvers.
pub(super) struct Names {
    /// Names without body prefix and dash.
    names: BTreeSet<String>,
}

impl Names {
    /// The names that the solvers of all known types have. `in_use` are the options of the bodies, without their
    /// prefix: their types are tried first, as they are combined there.
    pub(super) fn collect(session: &Session, in_use: &[Vec<Entry>]) -> Result<Names> {
        let matrix = tiny(session)?;
        let mut names: BTreeSet<String> = SILENT.split_whitespace().map(String::from).collect();
        let mut combinations: Vec<Vec<Entry>> = in_use.iter().map(|options| types_of(options)).collect();
        combinations.dedup();
        let entry = |name: &str, value: &str| (name.to_owned(), Some(value.to_owned()));
        combinations
            .extend(METHODS.split_whitespace().map(|name| vec![entry("ksp_type", name), entry("pc_type", "jacobi")]));
        combinations.extend(PRECONDITIONERS.split_whitespace().map(|word| {
            let (name, more) = word.split_once(':').unwrap_or((word, ""));
            let mut options = vec![entry("ksp_type", "cg"), entry("pc_type", name)];
            options.extend(more.split_once('=').map(|(more, value)| entry(&format!("pc_{more}"), value)));
            options
        }));
        for options in combinations {
            names.extend(ask(session, &matrix, &options)?);
        }
        Ok(Names { names })
    }

    /// All names, without dash and body prefix.
    pub(super) fn iter(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Whether PETSc has an option of this name (without dash and body prefix), in whatever solver: a known name, or
    /// one put together from the prefix of a nested solver and a known name, such as `mg_levels_` and `pc_sor_its`.
    pub(super) fn contains(&self, name: &str) -> bool {
        let name = without_numbers(name);
        if self.names.contains(&name) {
            return true;
        }
        // Fields have any name: fieldsplit_x_ksp_type.
        let field = name.strip_prefix("fieldsplit_");
        let fields = field.into_iter().flat_map(|rest| [Some(rest), rest.split_once('_').map(|(_, leaf)| leaf)]);
        if fields.flatten().any(|leaf| self.names.contains(leaf)) {
            return true;
        }
        let nests = self.names.iter().filter_map(|known| known.strip_suffix("ksp_type"));
        nests
            .filter(|nest| !nest.is_empty())
            .any(|nest| name.strip_prefix(nest).is_some_and(|leaf| self.names.contains(leaf)))
    }
}

/// The options that choose types, of which the others depend.
fn types_of(options: &[Entry]) -> Vec<Entry> {
    options.iter().filter(|(name, _)| name.ends_with("_type")).cloned().collect()
}

/// Makes one solver with these options and returns the names in its help.
fn ask(session: &Session, matrix: &Matrix, types: &[Entry]) -> Result<BTreeSet<String>> {
    thread_local! {
        static COUNT: Cell<usize> = const { Cell::new(0) };
    }
    // PETSc shows the help of a prefix once, so each solver has its own.
    COUNT.set(COUNT.get() + 1);
    let prefix = format!("winklerprobe{}_", COUNT.get());
    let options = session.options();
    let helped = options.has("-help");
    for (name, value) in types {
        options.set(&format!("-{prefix}{name}"), value.as_deref())?;
    }
    options.set("-help", None)?;
    let (made, text) = printed(session, || {
        let mut ksp = Ksp::new(session, &prefix)?;
        ksp.set_operator(matrix)?;
        // A type that does not fit tells its options all the same.
        let _ = ksp.set_from_options().and_then(|()| ksp.set_up());
        Ok(())
    });
    if !helped {
        options.clear("-help")?;
    }
    for (name, _) in types {
        options.clear(&format!("-{prefix}{name}"))?;
    }
    made?;
    Ok(names_in(&text, &prefix))
}

/// Prints the options of a solver as `-help` does, where a run makes none.
pub fn show_help(session: &Session) -> Result<()> {
    let mut ksp = Ksp::new(session, "")?;
    ksp.set_operator(&tiny(session)?)?;
    ksp.set_from_options()?;
    ksp.set_up()
}

/// The names in a help text: the words that begin its lines, without the prefix that most of them have.
fn names_in(text: &str, prefix: &str) -> BTreeSet<String> {
    text.lines()
        .filter_map(|line| {
            let word = line.trim_start().strip_prefix('-')?;
            let end = word.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(word.len());
            Some(without_numbers(word[..end].strip_prefix(prefix).unwrap_or(&word[..end])))
        })
        .filter(|name| !name.is_empty())
        .collect()
}

/// The name without the numbers of levels and blocks: `mg_levels_2_ksp_type` is `mg_levels_ksp_type`, as for PETSc.
fn without_numbers(name: &str) -> String {
    let words: Vec<&str> = name.split('_').collect();
    let last = words.len() - 1;
    let kept = words.iter().enumerate().filter(|(i, word)| {
        *i == 0 || *i == last || word.is_empty() || !word.bytes().all(|byte| byte.is_ascii_digit())
    });
    kept.map(|(_, word)| *word).collect::<Vec<_>>().join("_")
}

/// A small symmetric positive definite matrix, large enough for two levels of multigrid: a chain of 128 springs.
fn tiny(session: &Session) -> Result<Matrix> {
    let n = 128;
    let (mut row_ptr, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in 0..n {
        for column in [row - 1, row, row + 1] {
            if (0..n).contains(&column) {
                columns.push(column as Int);
                values.push(if column == row { 2.5 } else { -1.0 });
            }
        }
        row_ptr.push(columns.len() as Int);
    }
    let mut matrix = Matrix::from_csr(session, 1, row_ptr, columns, values)?;
    matrix.set_spd()?;
    Ok(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_a_help_text() {
        let text = "  -p1_ksp_type <now gmres> (one of) cg (KSPSetType)\n  -p1_mg_levels_1_pc_type: x\n\
                    KLU Options:\n -mat_klu_tol <1 : 1>: see -ksp_other\n";
        let names: Vec<String> = names_in(text, "p1_").into_iter().collect();
        assert_eq!(names, ["ksp_type", "mat_klu_tol", "mg_levels_pc_type"]);
        assert_eq!(without_numbers("mat_mumps_icntl_4"), "mat_mumps_icntl_4");
    }

    #[test]
    fn nested_names_are_put_together() {
        let names = Names { names: ["ksp_type", "pc_sor_its", "mg_levels_ksp_type"].map(String::from).into() };
        assert!(names.contains("pc_sor_its"));
        assert!(names.contains("mg_levels_3_pc_sor_its"));
        assert!(names.contains("fieldsplit_0_ksp_type") && names.contains("fieldsplit_u_ksp_type"));
        assert!(!names.contains("fieldsplit_u_ksp_typ") && !names.contains("mg_coarse_pc_sor_its"));
        assert!(!names.contains("mg_levels_pc_sor_it"));
    }
}

//! The option names that PETSc knows, read from its own help texts.
//!
//! PETSc has no list of its options. Each object prints its own options when it reads them while `-help` is set. So this module makes solvers
//! for a tiny matrix, each under a prefix of its own, and reads what they print. The solvers are also set up, because nested objects
//! (MUMPS, blocks, multigrid levels) print their options only then.

use crate::error::Result;
use crate::petsc::{Entry, Int, Ksp, Matrix, Session, printed};
use std::cell::Cell;
use std::collections::BTreeSet;

/// Krylov methods that can solve with a symmetric positive definite matrix, or at least start to.
pub(super) const METHODS: &str = "richardson chebyshev cg groppcg pipecg pipecgrr pipelcg pipeprcg pipecg2 cgne nash stcg gltr fcg \
    pipefcg gmres pipefgmres fgmres lgmres dgmres pgmres tcqmr bcgs ibcgs qmrcgs fbcgs fbcgsr bcgsl pipebcgs cgs tfqmr \
    cr pipecr lsqr preonly bicg minres symmlq lcd gcr pipegcr tsirm cgls";

/// Preconditioners. A preconditioner may have a second option behind a colon, without its `pc_`, with which PETSc prints more options.
pub(super) const PRECONDITIONERS: &str = "none jacobi pbjacobi vpbjacobi sor eisenstat ilu icc bjacobi asm gasm mg gamg redundant ksp \
    svd kaczmarz telescope composite fieldsplit \
    hypre:hypre_type=boomeramg hypre:hypre_type=euclid hypre:hypre_type=parasails hypre:hypre_type=pilut ml \
    lu:factor_mat_solver_type=petsc cholesky:factor_mat_solver_type=petsc lu:factor_mat_solver_type=mumps \
    cholesky:factor_mat_solver_type=mumps lu:factor_mat_solver_type=superlu lu:factor_mat_solver_type=superlu_dist \
    lu:factor_mat_solver_type=umfpack cholesky:factor_mat_solver_type=cholmod lu:factor_mat_solver_type=klu";

/// Options that objects read although their help does not have them.
const SILENT: &str = "mat_type mat_view mat_no_inode mat_inode_limit mat_product_algorithm matmatmult_via matptap_via vec_type \
    vec_view ksp_converged_reason";

/// The names of all options that solvers of PETSc have, without body prefix and dash.
pub(super) struct Names(BTreeSet<String>);

impl Names {
    /// Collect the names that solvers of all known types have. `in_use` are the options of the bodies without their
    /// prefix. Solvers with the combinations of types in them are asked, too.
    pub(super) fn collect(session: &Session, in_use: &[Vec<Entry>]) -> Result<Names> {
        let matrix = tiny(session)?;
        let mut names: BTreeSet<String> = SILENT.split_whitespace().map(String::from).collect();
        let mut combinations: Vec<Vec<Entry>> = in_use.iter().map(|options| types_of(options)).collect();
        combinations.dedup();
        combinations
            .extend(METHODS.split_whitespace().map(|name| vec![entry("ksp_type", name), entry("pc_type", "jacobi")]));
        combinations.extend(PRECONDITIONERS.split_whitespace().map(preconditioner));
        for options in combinations {
            names.extend(ask(session, &matrix, &options)?);
        }
        Ok(Names(names))
    }

    /// Return all names.
    pub(super) fn iter(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(String::as_str)
    }

    /// Return whether some solver of PETSc has an option of this name (without dash and body prefix). The name is a known one, or
    /// one put together from the prefix of a nested solver and a known name, such as `mg_levels_` and `pc_sor_its`.
    pub(super) fn contains(&self, name: &str) -> bool {
        let name = without_numbers(name);
        if self.0.contains(&name) {
            return true;
        }
        // the word for a field is free, as x in fieldsplit_x_ksp_type
        let field = name.strip_prefix("fieldsplit_");
        let fields = field.into_iter().flat_map(|rest| [Some(rest), rest.split_once('_').map(|(_, leaf)| leaf)]);
        if fields.flatten().any(|leaf| self.0.contains(leaf)) {
            return true;
        }
        let nests = self.0.iter().filter_map(|known| known.strip_suffix("ksp_type")).filter(|nest| !nest.is_empty());
        nests.filter_map(|nest| name.strip_prefix(nest)).any(|leaf| self.0.contains(leaf))
    }
}

/// Return the options that choose types; the other options of a solver depend on these.
fn types_of(options: &[Entry]) -> Vec<Entry> {
    options.iter().filter(|(name, _)| name.ends_with("_type")).cloned().collect()
}

fn entry(name: &str, value: &str) -> Entry {
    (name.to_owned(), Some(value.to_owned()))
}

/// Return the options that choose a preconditioner, written as in [`PRECONDITIONERS`].
fn preconditioner(word: &str) -> Vec<Entry> {
    let (name, more) = word.split_once(':').unwrap_or((word, ""));
    let more = more.split_once('=').map(|(option, value)| entry(&format!("pc_{option}"), value));
    [entry("ksp_type", "cg"), entry("pc_type", name)].into_iter().chain(more).collect()
}

/// Make one solver with these options and return the names in its help.
fn ask(session: &Session, matrix: &Matrix, types: &[Entry]) -> Result<BTreeSet<String>> {
    thread_local! {
        static COUNT: Cell<usize> = const { Cell::new(0) };
    }
    // PETSc prints the help of a prefix only once, so each solver has its own prefix
    COUNT.set(COUNT.get() + 1);
    let prefix = format!("winklerprobe{}_", COUNT.get());
    let options = session.options();
    let had_help = options.has("-help");
    for (name, value) in types {
        options.set(&format!("-{prefix}{name}"), value.as_deref())?;
    }
    options.set("-help", None)?;
    let (made, text) = printed(session, || {
        let mut ksp = Ksp::new(session, &prefix)?;
        ksp.set_operator(matrix)?;
        // a type that does not fit prints its options all the same
        let _ = ksp.set_from_options().and_then(|()| ksp.set_up());
        Ok(())
    });
    if !had_help {
        options.clear("-help")?;
    }
    for (name, _) in types {
        options.clear(&format!("-{prefix}{name}"))?;
    }
    made?;
    Ok(names_in(&text, &prefix))
}

/// Print the options of a solver as `-help` does, for a run that makes no solver of PETSc.
pub fn show_help(session: &Session) -> Result<()> {
    let mut ksp = Ksp::new(session, "")?;
    ksp.set_operator(&tiny(session)?)?;
    ksp.set_from_options()?;
    ksp.set_up()
}

/// Return the names in a help text: the words that begin its lines with a dash. Most of them have the prefix, which is removed.
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

/// Return the name without numbers of levels and blocks: `mg_levels_2_ksp_type` becomes `mg_levels_ksp_type`, which PETSc treats alike.
fn without_numbers(name: &str) -> String {
    let words: Vec<&str> = name.split('_').collect();
    let last = words.len() - 1;
    let kept = words.iter().enumerate().filter(|(i, word)| {
        *i == 0 || *i == last || word.is_empty() || !word.bytes().all(|byte| byte.is_ascii_digit())
    });
    kept.map(|(_, word)| *word).collect::<Vec<_>>().join("_")
}

/// Return a small symmetric positive definite matrix that is large enough for two levels of multigrid: a chain of 128 springs.
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
        let names = Names(["ksp_type", "pc_sor_its", "mg_levels_ksp_type"].map(String::from).into());
        assert!(names.contains("pc_sor_its"));
        assert!(names.contains("mg_levels_3_pc_sor_its"));
        assert!(names.contains("fieldsplit_0_ksp_type") && names.contains("fieldsplit_u_ksp_type"));
        assert!(!names.contains("fieldsplit_u_ksp_typ") && !names.contains("mg_coarse_pc_sor_its"));
        assert!(!names.contains("mg_levels_pc_sor_it"));
    }
}

//! The options that stand in a scene. They choose solvers and set parameters of solvers, and do nothing else.
//!
//! PETSc's options also write files, remove folders, call a shell, load libraries and read more options. A scene may come from anybody, so it
//! may only have options of the lists in [`names`](super::names). An option that PETSc adds later is not among them.

use super::names::{Takes, bare, corrected, ends, looks, of_scenes, takes};
use crate::error::{Error, Kind, Result};
use crate::petsc::{Session, is_global};
use std::cell::RefCell;
use std::collections::BTreeSet;

thread_local! {
    /// Names of the scene's options in PETSc's table, which is one for the process. They are weaker than typed ones, and go with the scene.
    static OF_SCENE: RefCell<BTreeSet<String>> = const { RefCell::new(BTreeSet::new()) };
}

/// Controls of MUMPS that a scene may not set: 1 to 3 are numbers of Fortran files that MUMPS writes to, and 22 lets MUMPS write its factors to a
/// disk.
const WRITING: [&str; 4] = ["1", "2", "3", "22"];

/// Return the kind of value that an option takes, given its name without dash; `None` if a scene may not have it. The name may begin with the
/// prefixes of a body and of nested solvers.
fn takes_in_scene(name: &str) -> Option<Takes> {
    let name = name.to_ascii_lowercase();
    let writes = |number: &str| WRITING.contains(&number.trim_start_matches('0'));
    let is_plain = name.chars().all(|sign| sign.is_ascii_alphanumeric() || sign == '_') && !is_global(&name);
    let is_writing = name.rsplit_once("mat_mumps_icntl_").is_some_and(|(_, number)| writes(number));
    ends(&name).find_map(|(_, leaf)| takes(leaf)).filter(|_| is_plain && !is_writing)
}

impl Takes {
    /// Return whether a value is of this kind; an option without a value has an empty one. No such value can name a file or a viewer.
    fn allows(self, value: &str) -> bool {
        let is_in = |list: &str| list.split_whitespace().any(|known| known.eq_ignore_ascii_case(value));
        let is_number = |word: &str| {
            word.parse::<f64>().is_ok() || ["default", "decide"].contains(&word.to_ascii_lowercase().as_str())
        };
        let is_sign = |sign: char| sign.is_ascii_alphanumeric() || "_-+/".contains(sign);
        match self {
            Self::Switch => value.is_empty() || is_in("true false yes no on off") || value.split(',').all(is_number),
            Self::Numbers => value.split(',').all(is_number),
            Self::Word => value.starts_with(|sign: char| sign.is_ascii_alphanumeric()) && value.chars().all(is_sign),
            Self::OneOf(list) => is_in(list),
        }
    }

    /// Return what the user may write, for a message.
    fn words(self) -> String {
        match self {
            Self::Switch => "nothing, true or false, or a number".to_owned(),
            Self::Numbers => "a number, or several with commas between them".to_owned(),
            Self::Word => "a word".to_owned(),
            Self::OneOf(list) => format!("one of {list}"),
        }
    }
}

/// Split the words of a scene's options into options, each with its value if it has one.
///
/// # Errors
/// A word that belongs to no option.
pub fn pairs(words: &[String]) -> Result<Vec<(&str, Option<&str>)>> {
    let (mut words, mut pairs) = (words.iter().peekable(), Vec::new());
    while let Some(word) = words.next() {
        if !word.starts_with('-') {
            return Err(Error::new(Kind::Scene, format!("`{word}` is no PETSc option"))
                .help("options start with a dash and take one value: -ksp_rtol 1e-10"));
        }
        let is_value = |next: &&String| !next.starts_with('-') || next.parse::<f64>().is_ok();
        pairs.push((word.as_str(), words.next_if(is_value).map(String::as_str)));
    }
    Ok(pairs)
}

/// Check that an option chooses a solver or sets a parameter of one, and can do nothing else: then a scene may have it.
///
/// # Errors
/// Any other option, and a value that such an option does not take.
pub fn check_of_scene(name: &str, value: Option<&str>) -> Result<()> {
    let Some(takes) = name.strip_prefix('-').and_then(takes_in_scene) else {
        let near = corrected(name, &of_scenes().collect::<Vec<_>>(), &[]).filter(|_| !looks(name));
        let typed = value.map_or(name.to_owned(), |value| format!("{name} {value}"));
        let help = format!(
            "a scene chooses solvers and sets their parameters; what else PETSc can do is for the command line: winkler solve SCENE {typed}"
        );
        let error = Error::new(Kind::Solver, format!("a scene may not have the option {name}"));
        return Err(error.help(near.map_or(help, |near| format!("did you mean -{near}?"))));
    };
    if takes.allows(value.unwrap_or_default()) {
        return Ok(());
    }
    let given = value.map_or("nothing".to_owned(), |value| format!("`{value}`"));
    let error = Error::new(Kind::Solver, format!("in a scene {name} takes {}, not {given}", takes.words()));
    Err(error.help("what PETSc takes besides is for the command line"))
}

/// Put the options of a scene into PETSc's table, in place of those of the scene before. One is left out if the command line has the same option,
/// or the plain one for an option of one body.
///
/// # Errors
/// An option is not one that a scene may have, or PETSc refuses the name.
pub fn set_of_scene(session: &Session, bodies: &[&str], words: &[String]) -> Result<()> {
    let options = session.options();
    OF_SCENE.take().iter().try_for_each(|name| options.clear(name))?;
    for (name, value) in pairs(words)? {
        check_of_scene(name, value)?;
        let of_scene =
            |name: &str| OF_SCENE.with_borrow(|names| names.contains(&format!("-{name}").to_ascii_lowercase()));
        if !bare(name, bodies).any(|name| options.has(name) && !of_scene(name)) {
            options.set(name, value)?;
            OF_SCENE.with_borrow_mut(|names| names.insert(name.to_ascii_lowercase()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check that the options of a text, separated by `|`, pass or do not pass.
    fn check_all(options: &str, pass: bool) {
        for option in options.split('|').map(str::trim) {
            let (name, value) = option.split_once(' ').map_or((option, None), |(name, value)| (name, Some(value)));
            assert_eq!(check_of_scene(name, value).is_ok(), pass, "{option}");
        }
    }

    #[test]
    fn solvers_and_their_parameters_pass() {
        let passing = "-ksp_rtol 1e-8 | -KSP_Type gmres | -upper_ksp_type minres | -pc_hypre_boomeramg_P_max 4 | -ksp_divtol inf | \
            -newton_mg_coarse_pc_hypre_boomeramg_relax_type_all symmetric-SOR/Jacobi | -mg_levels_3_esteig_ksp_max_it 12 | \
            -ksp_chebyshev_esteig 0,0.1,0,1.1 | -pc_fieldsplit_fields 0,1 | -ksp_knoll | -ksp_reuse_preconditioner false | \
            -pc_hypre_boomeramg_print_statistics 1 | -sub_pc_factor_mat_ordering_type rcm | -mat_mumps_cntl_7 1e-3";
        check_all(passing, true);
    }

    #[test]
    fn what_writes_loads_or_reads_is_refused() {
        let refused = "-ksp_view :f | -ksp_monitor | -upper_ksp_view_mat binary:f | -draw_save $(touch f) | -log_view :f | \
            -options_file f | -OPTIONS_FILE f | -prefix_push x_ | -dll_append f.so | -mat_mumps_ooc_tmpdir f | \
            -mat_mumps_icntl_01 7 | -mat_mumps_icntl_22 1 | -mat_mumps_icntl_+4 7 | -pc_type shell | -pc_type hpddm | \
            -ksp_type python | -pc_python_type a.b | -pc_hypre_type euclid | -pc_hypre_boomeramg_smooth_type Euclid | \
            -ksp_rtol 1e-8:f | -ksp_norm_type :f | -ksp_norm_type ../f | -ksp_norm_type ${HOME} | \
            -pc_factor_mat_ordering_type | --ksp_type cg | -ksp type cg | -help | -h | -";
        check_all(refused, false);
    }

    #[test]
    fn advice_is_a_name_or_the_command_line() {
        let advice = |name| check_of_scene(name, Some("x")).unwrap_err().advice().unwrap_or_default().to_owned();
        assert!(advice("-ksp_tpye").contains("-ksp_type"));
        assert!(advice("-ksp_view").ends_with("winkler solve SCENE -ksp_view x"));
        assert!(advice("-draw_save").contains("command line"));
    }
}

//! How PETSc options reach a body.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`).
//! PETSc never falls back from a prefix to the plain name, and nested objects read their options late. So, before the
//! objects of the bodies are made:
//!
//! 1. [`distribute`] copies each plain option of the object families to every body that has not its own;
//! 2. [`set_default`] and [`prefer_mumps`] add what the program chooses where nothing was typed;
//! 3. the objects are made and set up;
//! 4. [`mark_copies`] and [`unread()`] find what nobody read: a slip of the keyboard ends the run before it starts.

mod global;
mod looks;
mod probe;
mod refused;
mod split;
mod unread;

pub use looks::looks;
pub use probe::show_help;
pub use refused::{refuse_log, refuse_traps, refuse_words};
pub use split::split;
pub use unread::{Unread, UnreadKind, unread};

use crate::error::Result;
use crate::petsc::{FAMILIES, Options, Session};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Why an option is in the table although nobody typed it.
#[derive(Clone, Copy)]
enum Origin {
    /// A copy of the plain option.
    Copy,
    /// Our own choice.
    Default,
    /// Written in the scene: as good as typed, but weaker, and gone with the scene.
    Scene,
}

thread_local! {
    /// What this module put into PETSc's table, which is one for the process too.
    static OURS: RefCell<BTreeMap<String, Origin>> = const { RefCell::new(BTreeMap::new()) };
}

fn key(body: &str, name: &str) -> String {
    format!("-{body}_{}", name.trim_start_matches('-'))
}

/// Whether an option is a plain one of an object family, and of no body.
fn is_plain(name: &str, bodies: &[&str]) -> bool {
    let bare = name.trim_start_matches('-');
    FAMILIES.iter().any(|family| bare.starts_with(family)) && body_of(name, bodies).is_none()
}

/// The body whose prefix an option has, and the option without it.
fn body_of<'a, 'b>(name: &'a str, bodies: &[&'b str]) -> Option<(&'b str, &'a str)> {
    let bare = name.trim_start_matches('-');
    // of `brick` and `brick_1` the longer one
    let own = bodies.iter().filter_map(|body| Some((*body, bare.strip_prefix(body)?.strip_prefix('_')?)));
    own.min_by_key(|(_, rest)| rest.len())
}

/// Sets an option that nobody typed and remembers why.
fn put(options: &Options, name: &str, value: Option<&str>, origin: Origin) -> Result<()> {
    options.set(name, value)?;
    OURS.with_borrow_mut(|ours| ours.insert(name.to_owned(), origin));
    Ok(())
}

/// Why the program put an option into the table; `None` for what the user wrote, in the scene or on the command line.
fn origin(name: &str) -> Option<Origin> {
    OURS.with_borrow(|ours| ours.get(name).copied()).filter(|origin| !matches!(origin, Origin::Scene))
}

/// Sets an option that stands in the scene, unless the command line says something else: that option, or the plain one for
/// one of a body.
///
/// # Errors
/// When PETSc refuses the name.
pub fn set_of_scene(session: &Session, bodies: &[&str], name: &str, value: Option<&str>) -> Result<()> {
    let options = session.options();
    let typed =
        |name: &str| options.has(name) && !OURS.with_borrow(|ours| matches!(ours.get(name), Some(Origin::Scene)));
    let plain = body_of(name, bodies).map(|(_, bare)| format!("-{bare}"));
    if typed(name) || plain.is_some_and(|plain| typed(&plain)) {
        return Ok(());
    }
    put(&options, name, value, Origin::Scene)
}

/// Copies each plain option of the object families to `-<body>_<option>`, unless that is set. Give all bodies of the
/// scene on every rank, before any object is made.
///
/// ```
/// use winkler::{petsc::Session, solver::options};
/// let words = ["-ksp_type", "cg", "-lower_ksp_type", "gmres"];
/// let session = Session::start(&words.map(String::from))?;
/// options::distribute(&session, &["upper", "lower"])?;
/// assert_eq!(session.options().get("-upper_ksp_type").as_deref(), Some("cg"));
/// assert_eq!(session.options().get("-lower_ksp_type").as_deref(), Some("gmres"));
/// # Ok::<(), winkler::error::Error>(())
/// ```
///
/// # Errors
/// When PETSc refuses, which it does not for options it has taken before.
pub fn distribute(session: &Session, bodies: &[&str]) -> Result<()> {
    let options = session.options();
    for (name, value) in options.all()? {
        if !is_plain(&name, bodies) || origin(&name).is_some() {
            continue;
        }
        for body in bodies {
            let own = key(body, &name);
            if !options.has(&own) {
                put(&options, &own, value.as_deref(), Origin::Copy)?;
            }
        }
    }
    Ok(())
}

/// Takes back what this module put into the table, so that another scene of the process starts from the typed options.
///
/// # Errors
/// When PETSc refuses, which it does not for options it has taken before.
pub fn withdraw(session: &Session) -> Result<()> {
    let ours = OURS.take();
    ours.keys().try_for_each(|name| session.options().clear(name))
}

/// Sets `-<body>_<name>` unless it is set: a choice of the program, which never counts as typed or unread.
///
/// # Errors
/// When `name` is not one of an option.
pub fn set_default(session: &Session, body: &str, name: &str, value: Option<&str>) -> Result<()> {
    let (options, own) = (session.options(), key(body, name));
    if options.has(&own) { Ok(()) } else { put(&options, &own, value, Origin::Default) }
}

/// What the user typed as option `name` for this body, under its prefix or plainly; empty without a value.
///
/// ```
/// use winkler::{petsc::Session, solver::options::*};
/// let session = Session::start(&["-pc_type", "icc"].map(String::from))?;
/// distribute(&session, &["upper"])?;
/// set_default(&session, "upper", "pc_type", Some("gamg"))?;
/// set_default(&session, "upper", "ksp_type", Some("cg"))?;
/// assert_eq!(typed(&session, "upper", "pc_type").as_deref(), Some("icc"));
/// assert_eq!(typed(&session, "upper", "ksp_type"), None);
/// assert_eq!(session.options().get("-upper_ksp_type").as_deref(), Some("cg"));
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub fn typed(session: &Session, body: &str, name: &str) -> Option<String> {
    let (options, own) = (session.options(), key(body, name));
    if matches!(origin(&own), Some(Origin::Default)) {
        return None;
    }
    options.get(&own).or_else(|| is_plain(name, &[body]).then(|| options.get(name)).flatten())
}

/// Whether the user typed an option that chooses or steers the solver or matrix of this body, besides controls of MUMPS: then it is
/// a KSP of PETSc that is asked for. One that [`looks`] at a run asks for nothing.
///
/// ```
/// use winkler::{petsc::Session, solver::options::*};
/// let words = ["-up_pc_type", "icc", "-mat_mumps_icntl_14", "50", "-log_view", "-ksp_view"];
/// let session = Session::start(&words.map(String::from))?;
/// distribute(&session, &["up", "low"])?;
/// set_default(&session, "low", "pc_type", Some("gamg"))?;
/// assert!(asks_for_ksp(&session, "up")? && !asks_for_ksp(&session, "low")?);
/// # session.options().clear("-log_view")?;
/// # Ok::<(), winkler::error::Error>(())
/// ```
///
/// # Errors
/// When PETSc refuses, which it does not for options it has taken before.
pub fn asks_for_ksp(session: &Session, body: &str) -> Result<bool> {
    let all = session.options().all()?;
    let of_body = all.iter().filter(|(name, _)| !matches!(origin(name), Some(Origin::Default)));
    Ok(of_body.filter_map(|(name, _)| body_of(name, &[body])).any(|(_, bare)| {
        FAMILIES.iter().any(|family| bare.starts_with(family))
            && !looks(bare)
            && !["mat_mumps_icntl_", "mat_mumps_cntl_"].iter().any(|control| bare.starts_with(control))
    }))
}

/// The options that the user typed and that look at a solver, with their dash.
///
/// # Errors
/// When PETSc refuses, which it does not for options it has taken before.
pub fn watching(session: &Session, bodies: &[&str]) -> Result<Vec<String>> {
    let watches = |name: &String| {
        let bare = body_of(name, bodies).map_or(name.trim_start_matches('-'), |(_, bare)| bare);
        origin(name).is_none() && looks(bare) && FAMILIES.iter().any(|family| bare.starts_with(family))
    };
    Ok(session.options().all()?.into_iter().map(|(name, _)| name).filter(watches).collect())
}

/// Whether the user typed an option for this body alone, in the command line or the scene.
///
/// # Errors
/// When PETSc refuses, which it does not for options it has taken before.
pub fn names_body(session: &Session, body: &str) -> Result<bool> {
    let all = session.options().all()?;
    Ok(all.iter().any(|(name, _)| body_of(name, &[body]).is_some() && origin(name).is_none()))
}

/// Lets `cholesky` and `lu` mean MUMPS, in the solver of a body and in those nested in it (`-sub_pc_type lu`), where
/// `-pc_factor_mat_solver_type` was not given: PETSc's own factorisation is over 20 times slower.
///
/// ```
/// use winkler::{petsc::Session, solver::options::*};
/// let words = ["-pc_type", "asm", "-sub_pc_type", "lu", "-low_pc_type", "cholesky", "-low_pc_factor_mat_solver_type", "petsc"];
/// let session = Session::start(&words.map(String::from))?;
/// distribute(&session, &["up", "low"])?;
/// prefer_mumps(&session, "up")?;
/// prefer_mumps(&session, "low")?;
/// let options = session.options();
/// assert_eq!(options.get("-up_sub_pc_factor_mat_solver_type").as_deref(), Some("mumps"));
/// assert!(!options.has("-up_pc_factor_mat_solver_type"));
/// assert_eq!(options.get("-low_pc_factor_mat_solver_type").as_deref(), Some("petsc"));
/// # Ok::<(), winkler::error::Error>(())
/// ```
///
/// # Errors
/// When PETSc refuses, which it does not for options of these names.
pub fn prefer_mumps(session: &Session, body: &str) -> Result<()> {
    for (name, value) in session.options().all()? {
        let Some((_, bare)) = body_of(&name, &[body]) else {
            continue;
        };
        let Some(nest) = bare.strip_suffix("pc_type") else {
            continue;
        };
        if (nest.is_empty() || nest.ends_with('_')) && matches!(value.as_deref(), Some("cholesky" | "lu")) {
            set_default(session, body, &format!("{nest}pc_factor_mat_solver_type"), Some("mumps"))?;
        }
    }
    Ok(())
}

/// Marks each plain option as read of which a copy was read, or of which every body has its own instead.
///
/// ```
/// use winkler::{petsc::{Ksp, Session}, solver::options::*};
/// let words = ["-ksp_type", "cg", "-ksp_rtol", "1e-9", "-up_ksp_rtol", "1e-3", "-ksp_tpye", "gmres"];
/// let session = Session::start(&words.map(String::from))?;
/// distribute(&session, &["up"])?;
/// Ksp::new(&session, "up_")?.set_from_options()?;
/// mark_copies(&session, &["up"])?;
/// let left: Vec<String> = session.options().left()?.into_iter().map(|(name, _)| name).collect();
/// assert_eq!(left, ["-ksp_tpye", "-up_ksp_tpye"]);
/// # Ok::<(), winkler::error::Error>(())
/// ```
///
/// # Errors
/// When PETSc refuses, which it does not for options it has taken before.
pub fn mark_copies(session: &Session, bodies: &[&str]) -> Result<()> {
    let options = session.options();
    for (name, _) in options.left()? {
        if !is_plain(&name, bodies) || bodies.is_empty() {
            continue;
        }
        let mut copies = bodies.iter().map(|body| key(body, &name)).filter(|own| origin(own).is_some()).peekable();
        if copies.peek().is_none() || copies.any(|own| options.used(&own)) {
            options.mark_used(&name)?;
        }
    }
    Ok(())
}

/// Why a name cannot be that of a body; `None` for a good one. A body's name begins its options, so it is
/// `[a-z][a-z0-9_]*`, no word that begins options of PETSc, and between two `_` none of a solver inside another.
///
/// ```
/// use winkler::solver::options::forbidden_body_name;
/// assert_eq!(forbidden_body_name("upper2"), None);
/// assert!(forbidden_body_name("Upper").is_some_and(|reason| reason.contains("small letters")));
/// assert!(forbidden_body_name("mg").is_some_and(|reason| reason.contains("PETSc")));
/// ```
pub fn forbidden_body_name(name: &str) -> Option<&'static str> {
    let letters = name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
    if !letters || !name.starts_with(|first: char| first.is_ascii_lowercase()) {
        return Some(
            "it begins the PETSc options of the body, so it has small letters, digits and _ only, a letter first",
        );
    }
    let family = name.split('_').any(|word| FAMILIES.iter().any(|family| family.strip_suffix('_') == Some(word)));
    if family || global::is_global_word(name) || MORE_WORDS.contains(&name) {
        return Some("options of PETSc itself begin with this word");
    }
    None
}

/// Words that begin options of PETSc, besides [`FAMILIES`] and those of PETSc as a whole.
const MORE_WORDS: [&str; 29] = [
    "snes",
    "ts",
    "tao",
    "dm",
    "is",
    "da",
    "dmda",
    "dmplex",
    "petscspace",
    "petscfv",
    "petscds",
    "sf",
    "sfnode",
    "partitioner",
    "petscpartitioner",
    "vecscatter",
    "ao",
    "pf",
    "ps",
    "eps",
    "svd",
    "st",
    "bv",
    "hypre",
    "mumps",
    "npc",
    "no",
    "not",
    "winklerprobe",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_hides_a_family_that_its_name_begins_with() {
        assert!(is_plain("-mat_view", &["upper"]));
        assert!(!is_plain("-upper_mat_view", &["upper"]));
        assert!(!is_plain("-log_view", &["upper"]));
        assert_eq!(body_of("-up_ksp_type", &["u", "up"]), Some(("up", "ksp_type")));
        assert_eq!(body_of("-upper_ksp_type", &["up"]), None);
    }

    #[test]
    fn forbidden_names_have_their_reason() {
        for name in ["ksp", "pc", "mat", "vec", "sub", "mg", "snes", "ts", "tao", "dm", "is", "log", "options", "help"]
        {
            assert!(forbidden_body_name(name).is_some_and(|reason| reason.contains("PETSc itself")), "{name}");
        }
        for name in ["", "2up", "up_per", "üb", "a b"] {
            assert!(forbidden_body_name(name).is_some_and(|reason| reason.contains("letter")), "{name}");
        }
        assert_eq!(forbidden_body_name("punch"), None);
    }
}

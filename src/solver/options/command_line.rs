//! PETSc's options on the command line: telling them from the program's own words, and refusing those that would end the program without a
//! proper message.

use crate::error::{Error, Kind, Result};
use crate::petsc::Session;
use std::fs::OpenOptions;
use std::path::Path;

/// Split the arguments (without the program's name) into words of the program and words of PETSc, each in order.
///
/// A PETSc option has one dash and two or more letters. It takes the next word as its value unless that looks like an
/// option. A scene file (`*.toml`) or a command is never a value, except of `-options_file`. All words after `--` belong to the program.
pub fn split(words: impl IntoIterator<Item = String>) -> (Vec<String>, Vec<String>) {
    let (mut program, mut petsc) = (Vec::new(), Vec::new());
    let mut words = words.into_iter().peekable();
    while let Some(word) = words.next() {
        if word == "--" {
            program.push(word);
            program.extend(words);
            break;
        }
        if !is_petsc_option(&word) {
            program.push(word);
            continue;
        }
        let takes_file = word == "-options_file";
        petsc.push(word);
        let is_value = |next: &String| !is_option(next) && (takes_file || !is_scene_or_command(next));
        petsc.extend(words.next_if(is_value));
    }
    (program, petsc)
}

/// Return whether a word is a scene file or a command, which is never meant as the value of an option.
fn is_scene_or_command(word: &str) -> bool {
    word.ends_with(".toml") || ["solve", "check", "sweep", "bench", "mesh", "new", "completions", "man"].contains(&word)
}

/// Return whether a word is one dash and two or more characters, the first of them a letter. A whole string of options (for `bench --solver`) is
/// no option.
fn is_petsc_option(word: &str) -> bool {
    let bare = word.strip_prefix('-').filter(|bare| bare.len() >= 2 && !bare.contains(char::is_whitespace));
    bare.is_some_and(|bare| bare.starts_with(|c: char| c.is_ascii_alphabetic()))
}

/// Return whether a word begins with a dash and a letter, or with two dashes.
fn is_option(word: &str) -> bool {
    word.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c == '-' || c.is_ascii_alphabetic()))
}

/// Refuse options with which PETSc would stop at numbers that are not finite, and values that PETSc would read beyond their end.
///
/// # Errors
/// `-fp_trap` is on; a variable in a value, such as `${HOME}`, is not closed.
pub fn refuse_traps(session: &Session) -> Result<()> {
    let is_off = |value: &str| ["false", "no", "off", "0"].contains(&value.to_lowercase().as_str());
    let is_open = |value: &str| value.rsplit_once("${").is_some_and(|(_, rest)| !rest.contains('}'));
    for (name, value) in session.options().all()? {
        let value = value.unwrap_or_default();
        if is_open(&value) {
            // PETSc also reads the value when it finalizes, so the option is removed
            session.options().clear(&name)?;
            let message = format!("the value `{value}` of {name} begins a variable that it does not end");
            return Err(Error::new(Kind::Solver, message).help("write `${NAME}`"));
        }
        if name == "-fp_trap" && !is_off(&value) {
            let message = "-fp_trap would end this program: it computes with infinities on purpose";
            return Err(Error::new(Kind::Solver, message)
                .help("a number that should be finite and is not ends a run anyway, with the status `not-finite`"));
        }
    }
    Ok(())
}

/// Refuse a log file that cannot be written. PETSc writes it when it finalizes, where the user would not see the failure. The file may lie in the
/// folder of results.
///
/// # Errors
/// The file cannot be written.
pub fn refuse_log(session: &Session) -> Result<()> {
    // the value has the form TYPE:FILE:FORMAT
    let log = session.options().get("-log_view").unwrap_or_default();
    let Some(path) = log.split(':').nth(1).filter(|file| !file.is_empty() && session.rank() == 0).map(Path::new) else {
        return Ok(());
    };
    let is_new = !path.exists();
    OpenOptions::new().append(true).create(true).open(path).map_err(|cause| {
        Error::file(path, "write", &cause).help("-log_view names this file: let it lie in a folder that is there")
    })?;
    if is_new {
        // PETSc creates it anew
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::split;

    fn check(words: &str, program: &str, petsc: &str) {
        let (p, q) = split(words.split_whitespace().map(String::from));
        assert_eq!((p.join(" "), q.join(" ")), (program.to_owned(), petsc.to_owned()), "{words}");
    }

    #[test]
    fn words_go_where_they_belong() {
        check("solve s.toml", "solve s.toml", "");
        check("-options_file all.toml solve s.toml", "solve s.toml", "-options_file all.toml");
        check("solve -ksp_view s.toml", "solve s.toml", "-ksp_view");
        check("solve s.toml -ksp_view -o x -log_view --quiet", "solve s.toml -o x --quiet", "-ksp_view -log_view");
        check("-up_mat_shift -.5 -v s.toml", "-v s.toml", "-up_mat_shift -.5");
        check("-1e-3 - -o", "-1e-3 - -o", "");
        check("-ksp_type cg -- -ksp_type x", "-- -ksp_type x", "-ksp_type cg");
        check("-ksp_monitor", "", "-ksp_monitor");
        check("-ksp_monitor bench", "bench", "-ksp_monitor");
        let string = ["--solver", "-ksp_type cg -pc_type icc"].map(String::from);
        assert_eq!(split(string.clone()), (string.to_vec(), Vec::new()));
    }
}

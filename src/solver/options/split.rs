//! Telling PETSc's words from the program's on the command line.

/// Splits the arguments (without the program's name) into words of the program and words of PETSc, each in order.
///
/// A PETSc option has one dash and two or more letters; it takes the next word as its value unless that looks like an
/// option. A scene file (`*.toml`) or a command is never a value, except of `-options_file`. After `--` all belongs to the program.
///
/// ```
/// use winkler::solver::options::split;
/// let words = ["solve", "-ksp_monitor", "scene.toml", "-ksp_rtol", "1e-9", "-o", "out", "-pc_shift", "-1e-3", "--set", "a=1"];
/// let (program, petsc) = split(words.map(String::from));
/// assert_eq!(program, ["solve", "scene.toml", "-o", "out", "--set", "a=1"]);
/// assert_eq!(petsc, ["-ksp_monitor", "-ksp_rtol", "1e-9", "-pc_shift", "-1e-3"]);
/// ```
pub fn split(words: impl IntoIterator<Item = String>) -> (Vec<String>, Vec<String>) {
    let (mut program, mut petsc) = (Vec::new(), Vec::new());
    let mut words = words.into_iter().peekable();
    while let Some(word) = words.next() {
        if word == "--" {
            program.push(word);
            program.extend(words);
            break;
        }
        if !is_petsc(&word) {
            program.push(word);
            continue;
        }
        let file = word == "-options_file";
        petsc.push(word);
        if let Some(value) = words.next_if(|next| !is_option(next) && (file || !is_ours(next))) {
            petsc.push(value);
        }
    }
    (program, petsc)
}

/// A scene file or a command: never meant as the value of an option.
fn is_ours(word: &str) -> bool {
    word.ends_with(".toml") || ["solve", "check", "sweep", "bench", "mesh", "new", "completions", "man"].contains(&word)
}

/// One dash, then two or more signs of which the first is a letter; a whole string of options (for `bench --solver`) is
/// none.
fn is_petsc(word: &str) -> bool {
    let bare = word.strip_prefix('-').filter(|bare| bare.len() >= 2 && !bare.contains(char::is_whitespace));
    bare.is_some_and(|bare| bare.starts_with(|c: char| c.is_ascii_alphabetic()))
}

/// A dash and a letter, or two dashes.
fn is_option(word: &str) -> bool {
    word.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c == '-' || c.is_ascii_alphabetic()))
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

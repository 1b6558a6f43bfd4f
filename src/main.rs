//! The `winkler` program.

fn main() {
    std::process::exit(winkler::cli::run(std::env::args_os().collect()));
}

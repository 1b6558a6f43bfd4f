# What scripts share; they source it. Sets `root` and `target`, a folder to build in, and lets cargo and MPI be found and started.
# shellcheck shell=bash

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# rustup puts cargo here; shells started before rustup do not have it in PATH.
cargo_bin=${CARGO_HOME:-${HOME-}/.cargo}/bin
[[ :$PATH: == *":$cargo_bin:"* ]] || PATH=$cargo_bin:$PATH
# A relative target directory is the caller's, as it is for cargo.
target=${CARGO_TARGET_DIR:-$root/target}
[[ $target == /* ]] || target=$PWD/$target
[[ ! ${CARGO_TARGET_DIR-} ]] || export CARGO_TARGET_DIR=$target
# Open MPI refuses to start as root, which is what containers run as.
if ((EUID == 0)); then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi

# Set the machine up, build the release example of this name, and run it with the other arguments.
example() {
    "$root/scripts/setup" >&2
    (cd "$root" && cargo build --release --locked --quiet --example "$1" --target-dir "$target") >&2
    exec "$target/release/examples/$1" "${@:2}"
}

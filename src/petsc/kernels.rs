//! Kernels of OpenBLAS for this processor, where OpenBLAS does not recognise it.
//!
//! OpenBLAS chooses its kernels by the model number of the processor. For a model newer than itself it may take those for the first processors
//! with SSE3, on which dense products are up to eight times slower. The instruction sets that a processor says it has are the same
//! question answered for all models.

use super::blas::address;
use std::env;
use std::ffi::{CStr, c_char};

/// The variable by which OpenBLAS can be asked for kernels.
const CHOICE: &str = "OPENBLAS_CORETYPE";

/// Kernels that use the 256-bit registers of AVX2, and more.
const WIDE: [&str; 5] = ["Haswell", "Zen", "SkylakeX", "Cooperlake", "SapphireRapids"];

/// The kernels to ask for instead of `chosen` by a processor with these instruction sets; `None` if those will do.
fn better(chosen: &str, has_avx2: bool, has_avx512: bool) -> Option<&'static str> {
    let is_one_of = |known: &[&str]| known.iter().any(|name| name.eq_ignore_ascii_case(chosen));
    match (has_avx512, has_avx2) {
        // Zen kernels are for processors of another maker, and chosen by it
        (true, _) if !is_one_of(&WIDE[1..]) => Some("SkylakeX"),
        (false, true) if !is_one_of(&WIDE) => Some("Haswell"),
        _ => None,
    }
}

/// Has OpenBLAS choose again, if this processor can do more than what it chose and the user set no kernels. Before the first product, by the
/// thread that starts the session.
#[cfg(target_arch = "x86_64")]
pub(super) fn choose() {
    let [quit, start] = [c"gotoblas_dynamic_quit", c"gotoblas_dynamic_init"].map(address);
    let (Some(chosen), false) = (name(), quit.is_null() || start.is_null()) else { return };
    let has_avx512 = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    let (Some(better), None) = (better(&chosen, has_avx2, has_avx512), env::var_os(CHOICE)) else { return };
    // SAFETY: OpenBLAS declares both as void (void). The first forgets its table of kernels, the second reads the variable and makes it again;
    // no product runs meanwhile. The environment is as `launcher::quick` says.
    unsafe {
        env::set_var(CHOICE, better);
        for step in [quit, start] {
            let step: extern "C" fn() = std::mem::transmute(step);
            step();
        }
        env::remove_var(CHOICE);
    }
}

/// Other processors have one set of kernels, or OpenBLAS knows them.
#[cfg(not(target_arch = "x86_64"))]
pub(super) fn choose() {}

/// Name of the kernels in use, if OpenBLAS can choose among several.
pub(super) fn name() -> Option<String> {
    let address = address(c"openblas_get_corename");
    if address.is_null() {
        return None;
    }
    // SAFETY: OpenBLAS declares it as char *(void), and the text is a constant of its own.
    unsafe {
        let name: extern "C" fn() -> *const c_char = std::mem::transmute(address);
        Some(CStr::from_ptr(name()).to_string_lossy().into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_those_of_the_instruction_sets() {
        for (chosen, has_avx2, has_avx512, asked) in [
            ("Prescott", true, true, Some("SkylakeX")),
            ("Haswell", true, true, Some("SkylakeX")),
            ("Prescott", true, false, Some("Haswell")),
            ("Sandybridge", true, false, Some("Haswell")),
            ("Zen", true, true, None),
            ("SkylakeX", true, true, None),
            ("Cooperlake", true, true, None),
            ("Haswell", true, false, None),
            ("Prescott", false, false, None),
        ] {
            assert_eq!(better(chosen, has_avx2, has_avx512), asked, "{chosen}");
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn openblas_takes_them() {
        choose();
        let Some(name) = name().filter(|_| env::var_os(CHOICE).is_none()) else { return };
        if is_x86_feature_detected!("avx2") {
            assert!(WIDE.iter().any(|wide| wide.eq_ignore_ascii_case(&name)), "{name}");
        }
        // a product of the size that uses the kernels: L L' with L of ones has min(i, j) + 1
        let n = 300;
        let mut matrix: Vec<f64> = (0..n * n).map(|at| ((at / n).min(at % n) + 1) as f64).collect();
        assert_eq!(super::super::cholesky(&mut matrix, n).ok(), Some(true));
        let is_one = |at: usize| at % n > at / n || (matrix[at] - 1.0).abs() < 1e-9;
        assert!((0..n * n).all(is_one));
    }
}

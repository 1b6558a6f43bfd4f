//! Which bodies that are solved one by one are dealt out over the ranks.

use super::plan::Plan;
use crate::parallel::owners;
use crate::problem::solver::Preset;

/// Dofs that a rank could solve for in the time of the messages of a body that is dealt out: an iteration of conjugate gradients with multigrid
/// takes 0.5 us a dof (docs/scaling.md, 48^3: 42 s, 116 iterations, 705 894 dofs) and has some 50 messages of 10 us, four exchanges with
/// neighbours on each of eight levels and a few sums. Measured on two ranks of one machine (`patch-3d`, nu = 2, `ncg`, hypre): with 3993, 10 125 and
/// 27 783 dofs an iteration takes -28, 80 and 339 us more than half of that of one rank, the work of 0, 540 and 1900 dofs.
const MESSAGES: usize = 1000;

/// Whether each body is dealt out over all ranks: the largest ones, as many as make the sweep shortest. The others live whole, each on one
/// rank; where these are as many as the ranks and about as large, all do.
pub fn dealt_out(plans: &[Plan], ranks: usize) -> Vec<bool> {
    let loads: Vec<usize> = plans.iter().map(|plan| plan.dofs).collect();
    let may: Vec<bool> = plans.iter().map(|plan| plan.preset != Preset::Condensed && is_for_several(plan)).collect();
    largest(&loads, &may, ranks)
}

/// The same of bodies with these dofs, of which some `may` be dealt out.
fn largest(loads: &[usize], may: &[bool], ranks: usize) -> Vec<bool> {
    let mut order: Vec<usize> = (0..loads.len()).filter(|&body| may[body]).collect();
    order.sort_by_key(|&body| (std::cmp::Reverse(loads[body]), body));
    // with one rank there is nothing to be gained
    order.truncate(if ranks > 1 { order.len() } else { 0 });
    let among = |count: usize| {
        let mut dealt = vec![false; loads.len()];
        order[..count].iter().for_each(|&body| dealt[body] = true);
        dealt
    };
    let time = |count: &usize| {
        let dealt = among(*count);
        let whole: Vec<usize> = loads.iter().zip(&dealt).map(|(load, dealt)| if *dealt { 0 } else { *load }).collect();
        let mut busy = vec![0; ranks];
        owners(&whole, ranks).into_iter().zip(&whole).for_each(|(rank, load)| busy[rank] += load);
        let together: usize = order[..*count].iter().map(|&body| loads[body] / ranks + MESSAGES).sum();
        together + busy.into_iter().max().unwrap_or(0)
    };
    // of equal ones the fewest
    among((0..=order.len()).min_by_key(time).unwrap_or(0))
}

/// Whether the solver of a body, and all that the user nests in it, work with rows of several ranks.
fn is_for_several(plan: &Plan) -> bool {
    let chosen = &plan.chosen;
    if chosen.typed("pc_type").is_none() && plan.preset == Preset::Icc {
        return false;
    }
    let works = |name: &str, value: &str| match value {
        "hypre" | "gamg" | "jacobi" | "pbjacobi" | "none" | "mg" => true,
        "cholesky" | "lu" => {
            let package = name.replace("pc_type", "pc_factor_mat_solver_type");
            chosen.typed(&package).is_none_or(|package| package == "mumps")
        }
        _ => false,
    };
    chosen.typed_that_end("pc_type").all(|(name, value)| works(name, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One body is dealt out, of unequal ones the large one and, if that gains more than its messages take, the other; of as many equal ones as
    /// ranks none; of one too many, one.
    #[test]
    fn large_bodies_are_dealt_out() {
        let dealt = |loads: &[usize], ranks| largest(loads, &vec![true; loads.len()], ranks);
        assert_eq!(dealt(&[100_000], 2), [true]);
        assert_eq!(dealt(&[100_000], 1), [false]);
        assert_eq!(dealt(&[1_500, 80_000], 2), [false, true]);
        assert_eq!(dealt(&[10_000, 80_000], 2), [true, true]);
        assert_eq!(dealt(&[50_000, 50_000], 2), [false, false]);
        assert_eq!(dealt(&[50_000, 50_000], 3), [true, true]);
        assert_eq!(dealt(&[50_000; 3], 2), [true, false, false]);
        assert_eq!(dealt(&[50_000; 64], 8), [false; 64]);
        // messages take longer than what is gained
        assert_eq!(dealt(&[600, 600], 3), [false, false]);
        assert_eq!(largest(&[80_000, 10_000], &[false, true], 4), [false, false]);
    }
}

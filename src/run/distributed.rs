//! The choice of the bodies that are distributed over the ranks, among those that are solved one by one.

use super::plan::Plan;
use crate::parallel::owners;
use crate::problem::solver::Preset;

/// Dofs for which a rank could solve in the time of the messages of a distributed body. An iteration of conjugate gradients with
/// multigrid takes 0.5 us per dof (docs/scaling.md, 48^3: 42 s, 116 iterations, 705 894 dofs). It has some 50 messages of 10 us:
/// four exchanges with neighbours on each of eight levels, and a few sums.
///
/// Measurements on two ranks of one machine (`patch-3d`, nu = 2, `ncg`, hypre) had 3993, 10 125 and 27 783 dofs. An iteration
/// takes -28, 80 and 339 us more than half of that of one rank, which is the work of 0, 540 and 1900 dofs.
const MESSAGES: usize = 1000;

/// Return whether each body is distributed over all ranks. The largest ones are, as many as make the sweep shortest. Each other
/// body stays whole on one rank. If there are as many bodies as ranks and they are about equally large, all stay whole.
pub fn distributed_bodies(plans: &[Plan], ranks: usize) -> Vec<bool> {
    let loads: Vec<usize> = plans.iter().map(|plan| plan.dofs).collect();
    let may: Vec<bool> = plans.iter().map(|plan| plan.preset != Preset::Condensed && is_for_several(plan)).collect();
    largest(&loads, &may, ranks)
}

/// Return whether each body is distributed, from the dofs of each (`loads`) and from whether it `may` be distributed.
fn largest(loads: &[usize], may: &[bool], ranks: usize) -> Vec<bool> {
    let mut order: Vec<usize> = (0..loads.len()).filter(|&body| may[body]).collect();
    order.sort_by_key(|&body| (std::cmp::Reverse(loads[body]), body));
    // One rank gains nothing.
    order.truncate(if ranks > 1 { order.len() } else { 0 });
    let among = |count: usize| {
        let mut distributed = vec![false; loads.len()];
        order[..count].iter().for_each(|&body| distributed[body] = true);
        distributed
    };
    let time = |count: &usize| {
        let distributed = among(*count);
        let whole: Vec<usize> =
            loads.iter().zip(&distributed).map(|(load, distributed)| if *distributed { 0 } else { *load }).collect();
        let mut busy = vec![0; ranks];
        owners(&whole, ranks).into_iter().zip(&whole).for_each(|(rank, load)| busy[rank] += load);
        let together: usize = order[..*count].iter().map(|&body| loads[body] / ranks + MESSAGES).sum();
        together + busy.into_iter().max().unwrap_or(0)
    };
    // If times are equal, the fewest bodies are distributed.
    among((0..=order.len()).min_by_key(time).unwrap_or(0))
}

/// Return whether the solver of a body, and all solvers that the user nests in it, work with rows on several ranks.
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
    chosen.all_typed().filter(|(name, _)| name.ends_with("pc_type")).all(|(name, value)| works(name, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A single body is distributed. If bodies are unequal, the large one is distributed, and the other one if that gains more
    /// than its messages take. If there are as many equal bodies as ranks, none is distributed. With one body too many, one is.
    #[test]
    fn large_bodies_are_distributed() {
        let distributed = |loads: &[usize], ranks| largest(loads, &vec![true; loads.len()], ranks);
        assert_eq!(distributed(&[100_000], 2), [true]);
        assert_eq!(distributed(&[100_000], 1), [false]);
        assert_eq!(distributed(&[1_500, 80_000], 2), [false, true]);
        assert_eq!(distributed(&[10_000, 80_000], 2), [true, true]);
        assert_eq!(distributed(&[50_000, 50_000], 2), [false, false]);
        assert_eq!(distributed(&[50_000, 50_000], 3), [true, true]);
        assert_eq!(distributed(&[50_000; 3], 2), [true, false, false]);
        assert_eq!(distributed(&[50_000; 64], 8), [false; 64]);
        // The messages take longer than the gain.
        assert_eq!(distributed(&[600, 600], 3), [false, false]);
        assert_eq!(largest(&[80_000, 10_000], &[false, true], 4), [false, false]);
    }
}

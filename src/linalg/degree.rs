//! Minimum degree ordering: an order in which the elimination of the vertices of a graph adds few edges.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

/// The vertices in the order of their elimination, each with its neighbours at that time.
pub type Order = Rc<Vec<(usize, Vec<usize>)>>;

thread_local! {
    /// The last graph with its order.
    static LAST: RefCell<(Vec<Vec<usize>>, Order)> = RefCell::default();
}

/// Return [`order`] of a graph; it is kept for the next call with the same graph. A run factors the springs between its bodies some ten times,
/// and the order takes a third as long as the factor.
pub fn order_again(graph: Vec<Vec<usize>>) -> Order {
    // a single vertex does not replace the graph that is kept
    if graph.len() < 2 {
        return order(graph).into();
    }
    LAST.with_borrow_mut(|(last, known)| {
        if *last != graph {
            *known = order(graph.clone()).into();
            *last = graph;
        }
        Rc::clone(known)
    })
}

/// Return the vertices in the order of their elimination, each with its neighbours at that time.
///
/// `graph` has the neighbours of each vertex, sorted, without the vertex itself. Every step eliminates the first vertex of least degree, and connects
/// its neighbours to each other (George, Liu: The evolution of the minimum degree ordering algorithm, 1989). The graph is explicit, because it is
/// small: one vertex per body.
pub fn order(mut graph: Vec<Vec<usize>>) -> Vec<(usize, Vec<usize>)> {
    let mut queue: BTreeSet<(usize, usize)> = graph.iter().enumerate().map(|(v, near)| (near.len(), v)).collect();
    let mut order = Vec::with_capacity(graph.len());
    while let Some((_, vertex)) = queue.pop_first() {
        let near = std::mem::take(&mut graph[vertex]);
        for &other in &near {
            let before = graph[other].len();
            let joined = union(&graph[other], &near, [vertex, other]);
            if joined.len() != before {
                queue.remove(&(before, other));
                queue.insert((joined.len(), other));
            }
            graph[other] = joined;
        }
        order.push((vertex, near));
    }
    order
}

/// Return the sorted union of two sorted lists without the members `without`.
fn union(a: &[usize], b: &[usize], without: [usize; 2]) -> Vec<usize> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut i, mut k) = (0, 0);
    while i < a.len() || k < b.len() {
        let next = a.get(i).copied().unwrap_or(usize::MAX).min(b.get(k).copied().unwrap_or(usize::MAX));
        i += usize::from(a.get(i) == Some(&next));
        k += usize::from(b.get(k) == Some(&next));
        if !without.contains(&next) {
            all.push(next);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    #[test]
    fn an_order_is_that_of_its_graph() {
        let chain = |n: usize| -> Vec<Vec<usize>> {
            (0..n).map(|v| [v.checked_sub(1), (v + 1 < n).then_some(v + 1)].into_iter().flatten().collect()).collect()
        };
        for n in [4, 4, 1, 4, 7, 4] {
            assert_eq!(*super::order_again(chain(n)), super::order(chain(n)), "{n}");
        }
    }

    #[test]
    fn leaves_go_before_their_tree_and_a_ring_is_closed() {
        // a star with centre 0: no edge is added, and the centre is among the last two
        let star = vec![vec![1, 2, 3, 4], vec![0], vec![0], vec![0], vec![0]];
        let order = super::order(star);
        assert!(order.iter().all(|(_, near)| near.len() <= 1));
        assert!(order[3..].iter().any(|(vertex, _)| *vertex == 0));
        // a ring of five: each has two neighbours until three are left
        let ring = (0..5).map(|v: usize| {
            let mut near = vec![(v + 1) % 5, (v + 4) % 5];
            near.sort_unstable();
            near
        });
        let degrees: Vec<usize> = super::order(ring.collect()).into_iter().map(|(_, near)| near.len()).collect();
        assert_eq!(degrees, [2, 2, 2, 1, 0]);
    }
}

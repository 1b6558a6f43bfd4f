//! The selection of the few things that are worth showing.

/// Return the indices of the `most` largest numbers in ascending order. Among equal numbers the first is preferred; a number
/// that is not finite counts as zero.
pub fn largest(numbers: impl Iterator<Item = f64>, most: usize) -> Vec<usize> {
    let numbers: Vec<f64> = numbers.map(|number| if number.is_finite() { number } else { 0.0 }).collect();
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|&i, &j| numbers[j].total_cmp(&numbers[i]));
    order.truncate(most);
    order.sort_unstable();
    order
}

#[cfg(test)]
mod tests {
    use super::largest;

    #[test]
    fn the_largest_keep_their_order() {
        let of = |most| largest([25.0, f64::NAN, 81.0, 25.0].into_iter(), most);
        assert_eq!([of(1), of(2), of(9)], [vec![2], vec![0, 2], vec![0, 1, 2, 3]]);
    }
}

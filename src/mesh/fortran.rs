//! Numbers as Fortran and Nastran write them.

/// Return a number whose exponent may begin with D, or with its sign alone; none if it is no finite number.
pub fn real(word: &str) -> Option<f64> {
    let mut text = word.trim().to_ascii_lowercase().replace('d', "e");
    if let Some(at) = text.rfind(['+', '-']).filter(|&at| at > 0 && !text[..at].ends_with('e')) {
        text.insert(at, 'e');
    }
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::real;

    #[test]
    fn numbers_of_fortran() {
        for (text, value) in
            [("1.0D0", 1.0), ("1.5+3", 1500.0), ("-1.5-3", -0.0015), ("2.d-1", 0.2), ("1e+2", 100.0), ("+7.", 7.0)]
        {
            assert_eq!(real(text), Some(value), "{text}");
        }
        for text in ["one", "", "-", "inf", "nan", "1e999", "1.5+", "d"] {
            assert_eq!(real(text), None, "{text}");
        }
    }
}

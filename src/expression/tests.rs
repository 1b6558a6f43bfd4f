use super::*;
use crate::data::{DataSpec, Detrend, Interpolation, Library, Outside};
use crate::error::Source;
use crate::linalg::portable;

const VARIABLES: &[&str] = &["x", "y", "z", "k"];

fn place(text: &str) -> Place {
    let source = Source { name: "scene.toml".into(), text: format!("gap = \"{text}\"\n") };
    Place { span: 6..8 + text.len(), source: Arc::new(source) }
}

fn parse(text: &str) -> Result<Expression> {
    Expression::parse(text, &place(text), KnownNames::of(VARIABLES))
}

fn field_of(text: &str, dimension: usize, iteration: bool) -> Result<Field> {
    let variables = coordinates(dimension, iteration);
    Field::parse(text, &place(text), KnownNames::of(&variables))
}

/// Factors of load steps become numbers in each step.
#[test]
fn factors_are_known_in_each_step() {
    let (text, factors) = ("depth * (x - shift)^2", ["depth".to_owned(), "shift".to_owned()]);
    let scope = KnownNames { factors: &factors, ..KnownNames::of(&["x", "y"]) };
    let field = Field::parse(text, &place(text), scope).unwrap();
    assert!(field.eval([3.0, 0.0, 0.0]).is_nan());
    assert_eq!(field.factors().collect::<Vec<_>>(), [0, 1]);
    assert_eq!(field.in_step(&[2.0, 1.0]).eval([3.0, 0.0, 0.0]), 8.0);
    let error = Field::parse("deep", &place("deep"), scope).expect_err("no factor").to_string();
    assert!(error.contains("known are x, y, depth, shift, pi"), "{error}");
}

fn value(text: &str, values: [f64; 4]) -> f64 {
    parse(text).unwrap_or_else(|error| panic!("{error}")).eval(&values)
}

#[test]
fn precedence_is_the_usual_one() {
    let (x, y, z, k) = (1.7_f64, -0.6_f64, 3.1_f64, 4.0_f64);
    let cases = [
        ("-x^2", -(x * x)),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("-2^-2", -0.25),
        ("10 - 4 - 3", 3.0),
        ("16 / 4 / 2", 2.0),
        ("1/2", 0.5),
        ("2 + 3 * 4", 14.0),
        ("(2 + 3) * 4", 20.0),
        ("-x * y", -x * y),
        ("x - -y", x + y),
        ("+x", x),
        ("1e-3 + .5 + 2. + 1E+2", 102.501),
        ("2*pi", 2.0 * std::f64::consts::PI),
        ("sin(x)^2 + cos(x)^2", 1.0),
        ("-sin(-x)", x.sin()),
        ("max(0, min(x, y, z))", 0.0),
        ("max(min(x, 2), min(y, 1), -5)", x),
        ("min(x, max(y, z - 1)) * 2", 2.0 * x),
        ("atan2(y, x)", y.atan2(x)),
        ("abs(y) + sign(y) + sign(0) + floor(x) + ceil(x)", 0.6 - 1.0 + 1.0 + 2.0),
        ("log(exp(x)) + log10(100) + sqrt(4)", x + 4.0),
        ("tan(x) - sin(x)/cos(x)", 0.0),
        ("asin(0.3) + acos(0.3)", std::f64::consts::FRAC_PI_2),
        ("cosh(x)^2 - sinh(x)^2", 1.0),
        ("tanh(atan(x)) - tanh(atan(x))", 0.0),
        ("x > 1 && k < 5", 1.0),
        ("x > 1 && k < 4 || y >= 0", 0.0),
        ("x < 1 || k == 4 && y != 0", 1.0),
        ("!(x > 1)", 0.0),
        ("x + 1 > 2 * y", 1.0),
        ("(x <= 1.7) * 3", 3.0),
        ("5e-4 * max(0, 1 - (x - 2)^2)^1.5", 5e-4 * (1.0 - (x - 2.0) * (x - 2.0)).powf(1.5)),
    ];
    for (text, expected) in cases {
        let found = value(text, [x, y, z, k]);
        assert!((found - expected).abs() <= 1e-14 * expected.abs().max(1.0), "{text}: {found}, not {expected}");
    }
}

/// Random trees, written with parentheses only where the grammar needs them, have the value of the tree: a test of
/// grammar and program.
#[test]
fn random_expressions_have_their_value() {
    let mut state = 7_u64;
    let point = [1.25, -0.5, 2.0, 3.0];
    for _ in 0..3000 {
        let (text, expected, _) = random(&mut state, 5, point);
        let found = value(&text, point);
        let same = found == expected || (found.is_nan() && expected.is_nan());
        assert!(same || (found - expected).abs() <= 1e-12 * expected.abs(), "{text}: {found}, not {expected}");
    }
}

/// Text, value and binding power of a random expression.
fn random(state: &mut u64, depth: usize, point: [f64; 4]) -> (String, f64, u8) {
    let mut draw = |n: u64| {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 33) % n
    };
    let kind = if depth == 0 { draw(2) } else { draw(9) };
    let choice = draw(5) as usize;
    let within = |(text, value, power): (String, f64, u8), least: u8| {
        if power < least { (format!("({text})"), value) } else { (text, value) }
    };
    match kind {
        0 => (["1", "2.5", "1e-1", ".5", "3"][choice].into(), [1.0, 2.5, 0.1, 0.5, 3.0][choice], 9),
        1 => (
            ["x", "y", "z", "k", "pi"][choice].into(),
            [point[0], point[1], point[2], point[3], std::f64::consts::PI][choice],
            9,
        ),
        2 => {
            let (text, value) = within(random(state, depth - 1, point), 6);
            (format!("-{text}"), -value, 6)
        }
        3 => {
            let (text, value, _) = random(state, depth - 1, point);
            let name = ["sin", "abs", "exp", "floor", "sqrt"][choice];
            let value = [portable::sin(value), value.abs(), portable::exp(value), value.floor(), value.sqrt()][choice];
            (format!("{name}({text})"), value, 9)
        }
        4 => {
            let (left, a, _) = random(state, depth - 1, point);
            let (right, b, _) = random(state, depth - 1, point);
            let larger = if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
            (format!("max({left}, {right})"), larger, 9)
        }
        _ => {
            let power = [4, 4, 5, 5, 7][choice];
            let (a, b) = (random(state, depth - 1, point), random(state, depth - 1, point));
            let (left, a) = within(a, if power == 7 { 8 } else { power });
            let (right, b) = within(b, if power == 7 { 6 } else { power + 1 });
            let value = [a + b, a - b, a * b, a / b, portable::pow(a, b)][choice];
            (format!("{left} {} {right}", ["+", "-", "*", "/", "^"][choice]), value, power)
        }
    }
}

#[test]
fn nan_is_not_hidden() {
    for text in
        ["max(0, sqrt(-1 - x))", "min(log(-1), x)", "log(-1) > 0", "!sqrt(-1)", "x > 0 && log(-1) > 0", "0*log(-1)"]
    {
        assert!(value(text, [1.0; 4]).is_nan(), "{text}");
    }
    assert_eq!(value("x < 0 && log(-1) > 0", [1.0; 4]), 0.0);
    assert_eq!(value("x > 0 || log(-1) > 0", [1.0; 4]), 1.0);
    assert!(value("k", [1.0, 1.0, 1.0, f64::NAN]).is_nan());
}

#[test]
fn variables_take_their_own_values() {
    assert_eq!(value("k + 10*z", [1.0, 2.0, 3.0, 4.0]), 34.0);
    let text = "100*c + a";
    let expression = Expression::parse(text, &place(text), KnownNames::of(&["c", "a"])).unwrap();
    assert_eq!(expression.eval(&[3.0, 5.0]), 305.0);
    let zone = "x > 1 && k < 5";
    let field = field_of(zone, 2, true).unwrap();
    assert_eq!([4, 5].map(|k| field.is_true_at([2.0, 0.0, 0.0], k).unwrap()), [true, false]);
}

#[test]
fn slips_are_pointed_at() {
    let cases = [
        ("x + u", "u", "unknown variable `u`", "known are x, y, z, k, pi"),
        ("2*sqr(x)", "sqr", "unknown function `sqr`", "did you mean `sqrt`?"),
        ("ln(x)", "ln", "unknown function `ln`", "log(x)"),
        ("x(1)", "x", "`x` is not a function", "multiply"),
        ("sin + 1", "sin", "`sin` needs its value in parentheses", "sin(...)"),
        ("max(1)", "max", "`max` takes 2 or more values, not 1", ""),
        ("sin(x, y)", "sin", "`sin` takes 1 value, not 2", ""),
        ("atan2()", "atan2", "`atan2` takes 2 values, not 0", ""),
        ("2x", "x", "expected an operator before `x`", "multiply"),
        ("(x + 1", "(", "`(` is never closed", ""),
        ("x + 1)", ")", "`)` without `(`", ""),
        ("0 < x < 1", "<", "comparisons do not chain", "0 < x && x < 1"),
        ("x = 1", "=", "unexpected `=`", "=="),
        ("x**2", "**", "unknown operator `**`", "x^2"),
        ("x +", "+", "the expression stops short", ""),
        // a blank of two bytes, as word processors have it
        ("x + \u{a0}", "\u{a0}", "the expression stops short", ""),
        ("* x", "*", "expected a value before `*`", ""),
        ("1.2.3", "1.2.3", "not a number", ""),
        ("1e999", "1e999", "too large", ""),
        ("0,5", ",", "`,` outside a function", "decimal point"),
        ("x and y", "and", "expected an operator before `and`", ""),
        ("3 µ", "µ", "`µ` is neither a variable nor an operator", "units that fit"),
        ("70 GPa", "GPa", "`GPa` is neither", "without their unit"),
    ];
    for (text, caret, message, help) in cases {
        let error = parse(text).expect_err(text);
        assert!(error.message().contains(message), "{text}: {error}");
        assert!(error.advice().unwrap_or_default().contains(help), "{text}: {error}");
        assert_eq!(crate::error::caret(&error), caret, "{text}: {error}");
    }
    for text in ["", "  "] {
        assert_eq!(parse(text).expect_err(text).message(), "the expression is empty");
    }
}

#[test]
fn long_expressions_have_their_value_and_deep_ones_are_refused() {
    let deep = format!("{}x{}", "(".repeat(5000), ")".repeat(5000));
    assert!(parse(&deep).expect_err("deep").message().contains("nested"));
    assert!(parse(&"-".repeat(5000)).is_err());
    // neither the parser nor the evaluation recurs with the length, and the memory is proportional to the text
    let long = vec!["x*y"; 200_000].join(" + ");
    assert_eq!(value(&long, [2.0, 0.5, 0.0, 0.0]), 2e5);
    let wide = format!("max({})", vec!["-x"; 100_000].join(", "));
    assert_eq!(value(&wide, [2.0, 0.0, 0.0, 0.0]), -2.0);
    // needs a larger stack than usual expressions
    let nested = (0..18).fold("x".to_owned(), |inner, _| format!("(x + y*{inner})"));
    assert_eq!(value(&nested, [2.0, 1.0, 0.0, 0.0]), 38.0);
}

#[test]
fn a_value_that_is_not_finite_is_refused_with_its_point() {
    let text = "sqrt(x - 1) + y";
    let field = field_of(text, 2, false).unwrap();
    assert_eq!(field.eval_finite("gap", [5.0, 1.0, 0.0]).unwrap(), 3.0);
    let error = field.eval_finite("gap", [0.5, 2.0, 0.0]).expect_err("NaN");
    assert_eq!(error.message(), "gap is not a finite number at x = 0.5, y = 2");
    let zone = "log(x) < z*k";
    let field = field_of(zone, 3, true).unwrap();
    assert!(field.is_true_at([1.0, 9.0, 2.0], 1).unwrap());
    assert!(!field.is_true_at([1.0, 9.0, 2.0], 0).unwrap());
    let error = field.is_true_at([-1.0, 9.0, 2.0], 3).expect_err("NaN");
    assert_eq!(error.message(), "psi is not a finite number at x = -1, y = 9, z = 2, k = 3");
}

#[test]
fn fields_without_variables_are_constants() {
    let text = "2*pi - 2*pi";
    assert!(field_of(text, 2, false).unwrap().is_zero());
    let error = field_of("1/0", 2, false).expect_err("infinite");
    assert_eq!(error.message(), "the expression is not a finite number but inf");
    let error = field_of("x*z", 2, false).expect_err("z in a plane problem");
    assert_eq!(error.message(), "unknown variable `z`");
    let error = field_of("x*k", 3, false).expect_err("k in a gap");
    assert_eq!(error.message(), "unknown variable `k`");
}

/// A law of c and x.
fn law(text: &str) -> Expression {
    Expression::parse(text, &place(text), KnownNames::of(&["c", "x"])).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn derivatives_agree_with_differences() {
    let functions = program::UNARY.iter().map(|function| function.name).map(|name| format!("{name}(0.3*c*x) + c"));
    let others = [
        "3*c^2.5 + x*c",
        "2^c/(1 + c^x)",
        "max(c, x) - min(c, 2*x, 1) + max(-c, -2)",
        "atan2(c, x) + atan2(x, c)",
        "c*(c > x) + !(c >= x)*c^2 + (c < x || c != 1 && x <= 2)*c",
        "-c^2 - -c/x - (c == 3)",
        "(1 - c)^2",
    ];
    for text in functions.chain(others.map(String::from)) {
        let law = law(&text);
        for (c, x) in [(0.7, 1.1), (1.3, 0.6), (1e-3, 0.9)] {
            let h = 1e-6 * c;
            let (value, slope) = law.eval_by(0, &[c, x]);
            let [low, high] = [c - h, c + h].map(|c| law.eval(&[c, x]));
            assert!((value - law.eval(&[c, x])).abs() <= 1e-15 * value.abs(), "{text}");
            let difference = (high - low) / (2.0 * h);
            assert!(
                (slope - difference).abs() < 1e-7 * (1.0 + slope.abs()) + 1e-9 / c,
                "{text} at {c}, {x}: {slope} {difference}"
            );
        }
    }
}

/// The chain rule holds for data, whatever variables their places depend on.
#[test]
fn derivatives_of_data_agree_with_differences() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("heights.csv");
    std::fs::write(&file, "1,3,2,7\n4,1,5,2\n0,2,6,3\n1,1,4,8\n").unwrap();
    let source = Source { name: "scene.toml".into(), text: "\"f(c*x, 1 + x - 0.5*c)^2 + c*f(1, c)\"".into() };
    let place = Place { span: 0..source.text.len(), source: Arc::new(source) };
    let spec = DataSpec {
        name: "f".into(),
        file: file.into(),
        origin: [0.0; 2],
        spacing: [0.5, 0.8],
        unit: 1.0,
        detrend: Detrend::None,
        interpolation: Interpolation::Cubic,
        outside: Outside::Error,
    };
    let library = Library::from([("f".to_owned(), Arc::new(Data::new(spec)))]);
    let text = "f(c*x, 1 + x - 0.5*c)^2 + c*f(1, c)";
    let law = Expression::parse(text, &place, KnownNames { data: &library, ..KnownNames::of(&["c", "x"]) }).unwrap();
    for values in [[0.7, 1.1], [1.2, 0.3]] {
        for variable in 0..2 {
            let (value, slope) = law.eval_by(variable, &values);
            let h = 1e-6;
            let [low, high] = [-h, h].map(|h| {
                let mut moved = values;
                moved[variable] += h;
                law.eval(&moved)
            });
            assert_eq!(value, law.eval(&values));
            assert!((slope - (high - low) / (2.0 * h)).abs() < 1e-7 * (1.0 + slope.abs()), "{values:?}: {slope}");
        }
    }
}

#[test]
fn derivatives_do_not_hide_nan() {
    for text in ["max(c, log(-1))", "max(log(-1), c)", "min(c, log(-1))", "min(log(-1), c)", "max(0, sqrt(-c))"] {
        assert!(law(text).eval_by(0, &[1.0, 1.0]).0.is_nan(), "{text}");
    }
}

#[test]
fn slopes_at_zero_are_those_of_the_formula() {
    assert_eq!(law("c^2").eval_by(0, &[0.0, 0.0]), (0.0, 0.0));
    assert_eq!(law("(x - 2)^2*c").eval_by(0, &[0.0, 1.0]).1, 1.0);
    assert_eq!(law("(x - 2)^2*c").eval_by(1, &[3.0, 1.0]).1, -6.0);
    assert_eq!(law("1e5*c + c^1.5").eval_by(0, &[0.0, 0.0]), (0.0, 1e5));
    assert_eq!(law("sqrt(c)").eval_by(0, &[0.0, 0.0]).1, f64::INFINITY);
    assert!(law("log(c)").eval_by(0, &[-1.0, 0.0]).0.is_nan());
}

use super::*;
use crate::error::{Located, Place, Result, Source};
use std::sync::Arc;

fn spec(file: &std::path::Path) -> DataSpec {
    let source = Source { name: "scene.toml".into(), text: "file = \"heights\"".into() };
    DataSpec {
        name: "rough".into(),
        file: Located::new(file.to_owned(), Place { source: Arc::new(source), span: 7..16 }),
        origin: [0.0; 2],
        spacing: [1.0; 2],
        unit: 1.0,
        detrend: Detrend::None,
        interpolation: Interpolation::Linear,
        outside: Outside::Error,
    }
}

/// The function of a file with these bytes.
fn load(bytes: impl AsRef<[u8]>, change: impl FnOnce(&mut DataSpec)) -> Result<Data> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("heights");
    std::fs::write(&path, bytes).unwrap();
    let mut spec = spec(&path);
    change(&mut spec);
    let data = Data::new(spec);
    data.load().map(|()| data)
}

/// A smooth function with its gradient.
fn smooth([x, y]: [f64; 2]) -> Sample {
    let (u, v) = (1.3 * x + 0.2, 0.7 * y - 0.4);
    Sample { value: u.sin() * v.cos(), gradient: [1.3 * u.cos() * v.cos(), -0.7 * u.sin() * v.sin()] }
}

fn grid(counts: [usize; 2], interpolation: Interpolation, outside: Outside, value: impl Fn([f64; 2]) -> f64) -> Grid {
    let spacing = [2.0 / (counts[0] - 1) as f64, 3.0 / (counts[1] - 1) as f64];
    let axis = |d: usize| grid::GridAxis { origin: [0.5, -1.0][d], spacing: spacing[d], count: counts[d] };
    let axes = [0, 1].map(axis);
    let place = |k: usize| {
        let index = [k % counts[0], k / counts[0]];
        [0, 1].map(|d| axes[d].origin + axes[d].spacing * index[d] as f64)
    };
    Grid { axes, values: (0..counts[0] * counts[1]).map(|k| value(place(k))).collect(), interpolation, outside }
}

/// Places inside the grids, also in the first and last cells.
const PLACES: [[f64; 2]; 6] = [[0.51, -0.99], [1.03, 0.3], [1.7, 1.1], [2.49, 1.99], [2.49, -0.9], [0.7, 1.5]];

#[test]
fn gradients_are_those_of_the_values() {
    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
        for outside in [Outside::Error, Outside::Clamp, Outside::Periodic] {
            let grid = grid([13, 9], interpolation, outside, |x| smooth(x).value);
            let far = [[0.3, 3.7], [7.1, -8.2], [-3.3, 0.4]].into_iter().filter(|_| outside != Outside::Error);
            for [x, y] in PLACES.into_iter().chain(far) {
                let h = 1e-6;
                let at = |x, y| grid.sample([x, y]).value;
                let found = grid.sample([x, y]).gradient;
                let expected = [(at(x + h, y) - at(x - h, y)) / (2.0 * h), (at(x, y + h) - at(x, y - h)) / (2.0 * h)];
                let error = (found[0] - expected[0]).hypot(found[1] - expected[1]);
                assert!(error < 1e-8, "{interpolation:?} {outside:?} at {x}, {y}: {found:?} {expected:?}");
            }
        }
    }
}

/// Linear interpolation has second order, cubic interpolation third order, both also at the border.
#[test]
fn interpolation_has_its_order() {
    for (interpolation, order) in [(Interpolation::Linear, 2.0), (Interpolation::Cubic, 3.0)] {
        let error = |fine: usize| {
            let grid = grid([8 * fine + 1, 8 * fine + 1], interpolation, Outside::Error, |x| smooth(x).value);
            // anywhere in the cells
            let many = (0..4000).map(|k| [0.5 + (0.618034 * k as f64) % 2.0, -1.0 + (1.3247 * k as f64) % 3.0]);
            many.map(|x| (grid.sample(x).value - smooth(x).value).abs()).fold(0.0, f64::max)
        };
        let found = (error(2) / error(8)).log(4.0);
        assert!((found - order).abs() < 0.35, "{interpolation:?}: {found}");
    }
    // a parabola has no error at all, also at the border
    let parabola = |[x, y]: [f64; 2]| 3.0 + x - 2.0 * y + 0.5 * x * x - x * y + 0.25 * y * y;
    let exact = grid([5, 4], Interpolation::Cubic, Outside::Error, parabola);
    for place in PLACES {
        assert!((exact.sample(place).value - parabola(place)).abs() < 1e-13, "{place:?}");
        let slope = 1.0 + place[0] - place[1];
        assert!((exact.sample(place).gradient[0] - slope).abs() < 1e-13, "{place:?}");
    }
}

#[test]
fn beyond_the_points_is_what_was_asked_for() {
    let at = |outside, place| grid([5, 4], Interpolation::Linear, outside, |[x, y]| x + 10.0 * y).sample(place);
    // half a spacing belongs to the points
    assert_eq!(at(Outside::Error, [0.26, -1.4]), Sample { value: 0.5 - 10.0, gradient: [0.0, 0.0] });
    for beyond in [[0.24, 0.0], [2.76, 0.0], [1.0, -1.6], [1.0, f64::NAN], [f64::INFINITY, 0.0]] {
        assert!(at(Outside::Error, beyond).value.is_nan(), "{beyond:?}");
    }
    assert_eq!(at(Outside::Clamp, [-9.0, 77.0]).value, 0.5 + 20.0);
    // a period is one spacing longer than from the first point to the last
    let periodic = |place: [f64; 2]| at(Outside::Periodic, place).value;
    for place in PLACES {
        let shifted = periodic([place[0] - 5.0 * 2.5, place[1] + 3.0 * 4.0]);
        assert!((periodic(place) - shifted).abs() < 1e-12, "{place:?}");
    }
    // between the last point and the first: the mean of both
    assert!((periodic([2.75, 0.0]) - 0.5 * (periodic([2.5, 0.0]) + periodic([0.5, 0.0]))).abs() < 1e-12);
}

#[test]
fn texts_of_many_kinds_are_read() {
    let kinds = [
        "1,2,3\n4,5,6\n",
        "x0,x1,x2\r\n1,2,3\r\n4,5,6",
        "\u{feff}# Channel: Z\n# Width: 3 mm\n1\t2\t3\n4\t5\t6\t\n\n",
        "  1.0   2e0 3\n\n  4 5   +6 \n# the end\n",
        "1;2;3\n4;5;6\n",
    ];
    for text in kinds {
        let data = load(text, |_| ()).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(data.grid().unwrap().values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{text}");
        assert_eq!((data.sample(&[2.0, 1.0]).value, data.arguments()), (6.0, 2));
    }
    for text in ["1\n3\n5\n", "1,3,5\n"] {
        let data = load(text, |spec| (spec.origin, spec.spacing, spec.unit) = ([10.0, 0.0], [0.5, 1.0], 2.0)).unwrap();
        assert_eq!((data.sample(&[10.75]).value, data.arguments()), (8.0, 1), "a profile");
    }
}

/// A file of NumPy with this header and these bytes of numbers.
fn numpy(kind: &str, fortran: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), numbers].concat()
}

#[test]
fn arrays_of_numpy_are_read() {
    let values = [1.0_f64, 2.0, 3.0, 4.0, 5.0, 6.0];
    let f8: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let f4: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_be_bytes()).collect();
    for (kind, bytes) in [("<f8", &f8), (">f4", &f4)] {
        let data = load(numpy(kind, "False", "(2, 3)", bytes), |_| ()).unwrap();
        assert_eq!(data.grid().unwrap().values, values, "{kind}");
        let data = load(numpy(kind, "True", "(3, 2)", bytes), |_| ()).unwrap();
        assert_eq!(data.grid().unwrap().values, [1.0, 4.0, 2.0, 5.0, 3.0, 6.0], "{kind}, columns first");
        assert_eq!(load(numpy(kind, "False", "(6,)", bytes), |_| ()).unwrap().arguments(), 1);
    }
    let refused = |bytes: &[u8]| load(bytes, |_| ()).expect_err("a bad file").message().to_owned();
    assert!(refused(&numpy("<f8", "False", "(2, 2, 2)", &f8)).contains("one or two directions"));
    assert!(refused(&numpy("<f8", "False", "(99999999999, 99999999999)", &f8)).contains("has 6 numbers"));
    assert!(refused(&numpy("<c16", "False", "(1, 3)", &f8)).contains("kind `<c16`"));
    let whole = numpy("<f8", "False", "(2, 3)", &f8);
    // 15 bytes that claim a header of 4 GB
    assert!(refused(&[&b"\x93NUMPY\x02\x00"[..], &u32::MAX.to_le_bytes(), b"{'d"].concat()).contains("ends before"));
    for length in 1..whole.len() {
        let words = refused(&whole[..length]);
        assert!(
            ["ends before", "is neither text", "has "].iter().any(|part| words.contains(part)),
            "{length}: {words}"
        );
    }
}

#[test]
fn a_plane_is_subtracted() {
    let wave = |i: usize, j: usize| if (i + j).is_multiple_of(2) { 1.0 } else { -1.0 };
    let row = |j| (0..4).map(|i| format!("{}", wave(i, j) + 7.0 + 0.5 * i as f64 - 3.0 * j as f64)).collect::<Vec<_>>();
    let text: String = (0..6).map(|j| row(j).join(" ") + "\n").collect();
    let level = load(text, |spec| spec.detrend = Detrend::Plane).unwrap();
    // the least squares leave a share of the wave itself: it is not orthogonal to the slopes on so few points
    let values = &level.grid().unwrap().values;
    let moments = [0, 1, 2].map(|c| (0..24).map(|k| [1.0, (k % 4) as f64, (k / 4) as f64][c] * values[k]).sum::<f64>());
    assert!(moments.iter().all(|moment| moment.abs() < 1e-12), "{moments:?}");
    let line = load("1,3,5\n", |spec| spec.detrend = Detrend::Plane).unwrap();
    assert!(line.grid().unwrap().values.iter().all(|height| height.abs() < 1e-12));
}

#[test]
fn bad_files_are_refused_with_their_line() {
    let cases: [(&str, &str); 9] = [
        ("", "has no two numbers"),
        ("a,b\nc,d\n", "has no two numbers"),
        ("7", "has no two numbers"),
        ("1,2\n3,4\n5\n", "line 3 has 1 numbers, lines before it 2"),
        ("# c\n1,2\n\n3,oops\n", "line 4: `oops` is not a number"),
        ("1,,2\n", "line 1: `` is not a number"),
        ("1,2\n3,nan\n", "no height in row 1, column 1"),
        ("1 2\n\0", "is neither text nor a file of NumPy"),
        ("PK\u{3}\u{4}....", "has no two numbers"),
    ];
    for (text, message) in cases {
        let error = load(text, |_| ()).expect_err(text);
        assert_eq!(crate::error::caret(&error), "\"heights\"");
        assert!(error.message().contains(message), "{text}: {error}");
    }
    let thin = load("1,2,3\n4,5,6\n", |spec| spec.interpolation = Interpolation::Cubic).expect_err("two rows");
    assert!(thin.message().contains("two points in a direction"), "{thin}");
}

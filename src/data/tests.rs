use super::*;
use crate::error::{Place, Result, Source};
use std::sync::Arc;

fn spec(file: &std::path::Path) -> DataSpec {
    let source = Source { name: "scene.toml".into(), text: "file = \"heights\"".into() };
    DataSpec {
        name: "rough".into(),
        file: file.to_owned(),
        place: Place { source: Arc::new(source), span: 7..16 },
        points: false,
        origin: [0.0; 2],
        spacing: [1.0; 2],
        unit: 1.0,
        missing: None,
        fill: Fill::Error,
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
        "1;2,0;3\n4;5;6\n",
        "\"a\" \"b\" \"c\"\n1 2 3\n4 5 6\n",
    ];
    for text in kinds {
        let data = load(text, |_| ()).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(data.grid().unwrap().values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{text}");
        assert_eq!(data.sample(&[2.0, 1.0]).value, 6.0);
        assert_eq!(data.arguments(), 2);
    }
    for text in ["1\n3\n5\n", "1,3,5\n"] {
        let data = load(text, |spec| (spec.origin, spec.spacing, spec.unit) = ([10.0, 0.0], [0.5, 1.0], 2.0)).unwrap();
        assert_eq!(data.arguments(), 1, "a profile");
        assert_eq!(data.sample(&[10.75]).value, 8.0);
    }
}

#[test]
fn arrays_of_numpy_are_read() {
    let file = |kind: &str, fortran: &str, shape: &str, numbers: &[u8]| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
        let header = format!("{header:<117}\n");
        [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), numbers].concat()
    };
    let values = [1.0_f64, 2.0, 3.0, 4.0, 5.0, 6.0];
    let f8: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let f4: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_be_bytes()).collect();
    let i2: Vec<u8> = values.iter().flat_map(|value| (*value as i16).to_le_bytes()).collect();
    for (kind, bytes) in [("<f8", &f8), (">f4", &f4), ("<i2", &i2)] {
        let data = load(file(kind, "False", "(2, 3)", bytes), |_| ()).unwrap();
        assert_eq!(data.grid().unwrap().values, values, "{kind}");
        let data = load(file(kind, "True", "(3, 2)", bytes), |_| ()).unwrap();
        assert_eq!(data.grid().unwrap().values, [1.0, 4.0, 2.0, 5.0, 3.0, 6.0], "{kind}, columns first");
        assert_eq!(load(file(kind, "False", "(6,)", bytes), |_| ()).unwrap().arguments(), 1);
    }
    let refused =
        |kind: &str, shape: &str| load(file(kind, "False", shape, &f8), |_| ()).unwrap_err().message().to_owned();
    assert!(refused("<f8", "(2, 2, 2)").contains("array of 3 directions"));
    assert!(refused("<f8", "(4, 3)").contains("ends before its 4 x 3 numbers"));
    assert!(refused("<f8", "(99999999999, 99999999999)").contains("ends before"));
    assert!(refused("<c16", "(1, 3)").contains("kind <c16"));
    assert!(refused("nonsense", "(1, 2)").contains("is no file of NumPy"));
}

#[test]
fn scattered_points_make_planes() {
    let plane = |x: f64, y: f64| 2.0 + 3.0 * x - 0.5 * y;
    let mut state = 1_u64;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let points: Vec<[f64; 2]> =
        (0..200).map(|_| [draw(), draw()]).chain([[0., 0.], [1., 0.], [0., 1.], [1., 1.]]).collect();
    let text: String = points.iter().map(|&[x, y]| format!("{x} {y} {}\n", plane(x, y))).collect();
    let data = load(&text, |spec| spec.points = true).unwrap();
    assert!(data.grid().is_none());
    for place in points.iter().copied().chain([[0.5, 0.5], [0.01, 0.97], [0.0, 0.3], [1.0, 1.0]]) {
        let sample = data.sample(&place);
        assert!((sample.value - plane(place[0], place[1])).abs() < 1e-9, "{place:?}");
        assert!((sample.gradient[0] - 3.0).hypot(sample.gradient[1] + 0.5) < 1e-7, "{place:?} {sample:?}");
    }
    assert!(data.sample(&[1.01, 0.5]).value.is_nan());
    // beyond the square the nearest place of its border counts
    let held = load(&text, |spec| (spec.points, spec.outside) = (true, Outside::Clamp)).unwrap();
    for (place, nearest, gradient) in [
        ([2.0, 0.3], [1.0, 0.3], [0.0, -0.5]),
        ([0.4, -7.0], [0.4, 0.0], [3.0, 0.0]),
        ([-1.0, 5.0], [0.0, 1.0], [0.0, 0.0]),
        ([3.0, -0.1], [1.0, 0.0], [0.0, 0.0]),
    ] {
        let sample = held.sample(&place);
        assert!((sample.value - plane(nearest[0], nearest[1])).abs() < 1e-9, "{place:?} {sample:?}");
        assert!(
            (sample.gradient[0] - gradient[0]).hypot(sample.gradient[1] - gradient[1]) < 1e-7,
            "{place:?} {sample:?}"
        );
    }
}

#[test]
fn points_of_a_regular_grid_are_one() {
    let text: String =
        (0..35).rev().map(|k| format!("{:.4};{:.4};{k}\n", (k % 7) as f64 / 6.0, (k / 7) as f64 / 3.0)).collect();
    let data = load(&text, |spec| (spec.points, spec.interpolation) = (true, Interpolation::Cubic)).unwrap();
    let grid = data.grid().expect("a grid");
    assert_eq!((grid.axes.map(|axis| axis.count), &grid.values[..3]), ([7, 5], &[0.0, 1.0, 2.0][..]));
    assert!((grid.axes[1].spacing - 1.0 / 3.0).abs() < 1e-4);
    // one is missing: triangles
    let holed: String = text.lines().skip(9).map(|line| format!("{line}\n")).collect();
    assert!(load(&holed, |spec| spec.points = true).unwrap().grid().is_none());
    // fields may be quoted
    assert_eq!(load("\"1\";\"2,5\"\n\"3\";\"4\"\n", |_| ()).unwrap().sample(&[1.0, 0.0]).value, 2.5);
    let even = load("0 1\n2 5\n1 3\n", |spec| spec.points = true).unwrap();
    assert_eq!((even.sample(&[1.5]).value, even.grid().is_some()), (4.0, true));
    let uneven = load("0 1\n2 5\n0.5 3\n", |spec| (spec.points, spec.outside) = (true, Outside::Clamp)).unwrap();
    let found = [-1.0, 0.25, 0.5, 1.25, 9.0].map(|x| uneven.sample(&[x]));
    assert_eq!(found.map(|sample| sample.value), [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!([found[0], found[1], found[3]].map(|sample| sample.gradient[0]), [0.0, 4.0, 2.0 / 1.5]);
}

#[test]
fn bad_files_are_refused_with_their_line() {
    let points = |spec: &mut DataSpec| spec.points = true;
    let cubic = |spec: &mut DataSpec| (spec.points, spec.interpolation) = (true, Interpolation::Cubic);
    let refused = |text: &str, change: &dyn Fn(&mut DataSpec)| {
        let error = load(text, |spec| change(spec)).expect_err(text);
        assert_eq!(crate::error::caret(&error), "\"heights\"");
        error.message().to_owned()
    };
    type Case<'a> = (&'a str, &'a dyn Fn(&mut DataSpec), &'a str);
    let cases: [Case; 16] = [
        ("", &|_| (), "has no numbers"),
        ("a,b\nc,d\n", &|_| (), "has no numbers"),
        ("7", &|_| (), "has one number"),
        ("1,2\n3,4\n5\n", &|_| (), "line 3 has 1 numbers, lines before it 2"),
        ("# c\n1,2\n\n3,oops\n", &|_| (), "line 4: `oops` is not a number"),
        ("1,,2\n", &|_| (), "line 1 lacks a number"),
        ("1,2\n3,nan\n", &|_| (), "no height at 1 of 4 points, the first in line 2, column 1"),
        ("1 2\n\0", &|_| (), "is neither text nor a file of NumPy"),
        ("1 2 3 4\n", &points, "has 4 numbers in a row"),
        ("1 2\r3 4\r5\r", &|_| (), "line 3 has 1 numbers, lines before it 2"),
        ("0 1\n1 2\n3e-16 1\n", &points, "line 3 is, but for rounding, at the place of line 1"),
        ("0 1\n1 2\n1.0000000000000002 1\n", &points, "line 3 is, but for rounding, at the place of line 2"),
        ("0 0 1\n1 0 1\n0 1 1\n1e-16 1 2\n", &points, "line 4 is, but for rounding, at the place of line 3"),
        ("0 0 1\n1 0 1\n0 1 1\n# c\n1 0 2\n", &points, "line 5 is at the place of line 2"),
        ("0 0 1\n1 1 1\n3 3 1\n", &points, "points on one line alone"),
        ("0 0 1\n1 0 1\n0.3 1 1\n", &cubic, "no cubic interpolation"),
    ];
    for (text, change, message) in cases {
        let found = refused(text, change);
        assert!(found.contains(message), "{text}: {found}");
    }
}

#[test]
fn files_of_numpy_are_as_long_as_they_say() {
    let refused = |bytes: &[u8]| load(bytes, |_| ()).expect_err("a damaged file").message().to_owned();
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }";
    let array = |numbers: &[f64]| {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16 + 1).to_le_bytes());
        bytes.extend(format!("{header}\n").bytes());
        numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes
    };
    let whole = array(&[1.0, 2.0, 4.0]);
    assert_eq!(load(&whole, |_| ()).unwrap().sample(&[1.5]).value, 3.0);
    assert!(refused(&array(&[1.0, 2.0])).contains("ends before its 3 x 1 numbers"));
    assert!(refused(&[&whole[..], b"more"].concat()).contains("has 4 bytes more than its 3 x 1 numbers"));
    for length in 0..whole.len() {
        // a file shorter than the name of the format is a text
        let words = refused(&whole[..length]);
        assert!(length < 6 || words.contains("ends") || words.contains("its own words"), "{length}: {words}");
    }
    // 15 bytes that claim a header of 4 GB
    let claims = [&b"\x93NUMPY\x02\x00"[..], &u32::MAX.to_le_bytes(), b"{'d"].concat();
    assert!(refused(&claims).contains("has 15 bytes, but a header of 4294967295 bytes by its own words"));
}

/// Waves of amplitude a in two directions have moments in closed form, and one summit in each period. Differences have a factor of their own.
#[test]
fn roughness_of_waves_is_known() {
    let (a, n, period) = (0.3, 64, 2.0);
    let (spacing, k) = (period / n as f64, 2.0 * std::f64::consts::PI / period);
    let axis = |_| grid::GridAxis { origin: 0.0, spacing, count: 2 * n };
    let wave =
        |at: usize| a * ((k * spacing * (at % (2 * n)) as f64).cos() + (k * spacing * (at / (2 * n)) as f64).cos());
    let values = (0..4 * n * n).map(wave).collect();
    let (interpolation, outside) = (Interpolation::Linear, Outside::Periodic);
    let surface = Grid { axes: [0, 1].map(axis), values, interpolation, outside };
    let super::grid::Roughness { range, height, slope, curvature } = surface.roughness();
    let half = 0.5 * k * spacing;
    let factor = half.sin() / half;
    assert!((range[0] + 2.0 * a).abs() < 1e-12 && (range[1] - 2.0 * a).abs() < 1e-12);
    assert!((height - a).abs() < 1e-12);
    assert!((slope - a * k * factor).abs() < 1e-12, "{slope}");
    assert!((curvature - 0.5 * a * k * k * factor * factor).abs() < 1e-10, "{curvature}");
    let Summits { density, radius, heights } = surface.summits().expect("summits");
    // two periods each way
    assert_eq!(heights.len(), 4);
    assert!((density - 1.0 / (period * period)).abs() < 1e-12 && (heights[3] - 2.0 * a).abs() < 1e-12);
    assert!((radius * a * k * k * factor * factor - 1.0).abs() < 1e-10, "{radius}");
    // where nothing repeats, points of the border are no summits
    assert_eq!(Grid { outside: Outside::Clamp, ..surface.clone() }.summits().expect("summits").heights.len(), 1);
    let count = 2 * n;
    let profile = Grid {
        axes: [surface.axes[0], grid::GridAxis { count: 1, ..surface.axes[1] }],
        values: surface.values[..count].to_vec(),
        ..surface
    };
    let found = profile.roughness();
    assert!((found.slope - a * k * factor * 0.5_f64.sqrt()).abs() < 1e-12, "{found:?}");
    assert!((found.curvature - a * k * k * factor * factor * 0.5_f64.sqrt()).abs() < 1e-10, "{found:?}");
    assert_eq!(profile.summits(), None);
}

/// Grids of geographers say where they are; their first row is the uppermost one with ESRI, the lowest one with Surfer.
#[test]
fn grids_with_a_header_are_read() {
    let esri = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner -20\ncellsize 2\nNODATA_value -1\n4 5 6\n1 2\n-1\n";
    let filled = |spec: &mut DataSpec| (spec.fill, spec.spacing) = (Fill::Nearest, [0.5; 2]);
    let data = load(esri, filled).unwrap();
    let grid = data.grid().unwrap();
    assert_eq!(grid.values, [1.0, 2.0, 2.0, 4.0, 5.0, 6.0]);
    // heights are in the middle of cells, half a cell from the corner; the scene has lengths of 2
    let axis = |origin, count| grid::GridAxis { origin, spacing: 1.0, count };
    assert_eq!(grid.axes, [axis(5.5, 3), axis(-9.5, 2)]);
    assert_eq!(data.missing(), 1);
    let centre = "NROWS 1\nNCOLS 2\nXLLCENTER 1,5\nYLLCENTER 0\nDX 2\nDY 1\n7 8\n";
    assert_eq!(load(centre, |_| ()).unwrap().sample(&[2.5]).value, 7.5);
    let text = "DSAA\n3 2\n10 14\n-20 -18\n1 6\n1 2\n1.70141e+38\n4 5 6\n";
    assert_eq!(load(text, |spec| spec.fill = Fill::Nearest).unwrap().grid().unwrap().values, grid.values);
    let numbers = [10.0, 14.0, -20.0, -18.0, 1.0, 6.0_f64].into_iter().flat_map(f64::to_le_bytes);
    let heights = [1.0, 2.0, 1.70141e38, 4.0, 5.0, 6.0_f32].into_iter().flat_map(f32::to_le_bytes);
    let binary: Vec<u8> = b"DSBB\x03\0\x02\0".iter().copied().chain(numbers).chain(heights).collect();
    let read = load(&binary, |spec| spec.fill = Fill::Nearest).unwrap();
    assert_eq!(read.grid().unwrap().values, grid.values);
    assert_eq!(read.grid().unwrap().axes[1], grid::GridAxis { origin: -20.0, spacing: 2.0, count: 2 });
    let refused = |bytes: &[u8]| load(bytes, |_| ()).expect_err("a bad file").message().to_owned();
    for length in 4..binary.len() {
        let words = refused(&binary[..length]);
        assert!(words.contains("ends within its header") || words.contains("by its header"), "{length}: {words}");
    }
    for (text, words) in [
        (esri, "has no height at 1 of 6 points, the first in line 8, column 2 (from 0)"),
        (&esri.replace("cellsize", "cellsiz"), "has no `cellsize` in its header"),
        (&esri.replace("5 6", "5"), "has 5 heights, and 3 x 2 by its header"),
        (&esri.replace("5 6", "5 x"), "line 7: `x` is not a number"),
        (&esri.replace("ncols 3", "ncols 3e30"), "has a header of"),
        (&esri.replace("cellsize 2", "cellsize 0"), "distances of 0 and 0"),
        (&text.replace("3 2", "-3 2"), "has a header of -3 x 2 heights"),
        ("DSRB....", "is a grid of Surfer 7"),
        ("aBCR-1.0\nManufacID = x\n", "is an SDF file"),
        ("bISO-1.0....", "is an SDF file"),
        ("PK\u{3}\u{4}....", "as x3p files are"),
    ] {
        let found = refused(text.as_bytes());
        assert!(found.contains(words), "{text}: {found}");
    }
}

#[test]
fn points_without_a_height_are_named_and_filled() {
    let missing = |numbers: &[f64], words: &[&str]| {
        let words = words.iter().map(|word| word.to_string()).collect();
        Some(NoData { numbers: numbers.to_vec(), words })
    };
    let values = |text: &str, named: Option<NoData>| {
        let data = load(text, |spec| (spec.missing, spec.fill) = (named, Fill::Linear)).unwrap();
        (data.grid().expect("a grid").values.clone(), data.missing())
    };
    let plane = (vec![0.0, 1.0, 2.0, 1.0, 2.0, 3.0, 2.0, 3.0, 4.0], 1);
    for (gap, named) in [
        ("-9999", missing(&[-9999.0], &[])),
        ("1.701410009187828e38", missing(&[1.70141e38], &[])),
        ("***", missing(&[], &["***"])),
        ("NaN", None),
        ("inf", None),
        ("", missing(&[7.0], &["-", ""])),
    ] {
        assert_eq!(values(&format!("0,1,2\n1,{gap},3\n2,3,4\n"), named), plane, "{gap}");
    }
    // points of a grid make a grid, also where one has no height; other points are left out
    let points = |last: &str| {
        let text: String = (0..8).map(|k| format!("{} {} {}\n", k % 3, k / 3, k % 3 + k / 3)).collect();
        load(text + last, |spec| (spec.points, spec.fill) = (true, Fill::Nearest)).unwrap()
    };
    let (on, off) = (points("2 2 NaN\n"), points("2.4 2.1 NaN\n"));
    assert_eq!((on.grid().map(|grid| grid.values[8]), on.missing()), (Some(3.0), 1));
    assert!(off.grid().is_none() && off.missing() == 1 && (off.sample(&[1.0, 1.0]).value - 2.0).abs() < 1e-12);
    let refused =
        |text: &str, change: &dyn Fn(&mut DataSpec)| load(text, |spec| change(spec)).unwrap_err().message().to_owned();
    let border: String =
        (0..6).map(|j| if j == 0 { "-9999,".repeat(6) + "\n" } else { format!("-9999,{j},2,3,4,-9999\n") }).collect();
    let waves = border.replace(",2,", ",2.5,").replace(",3,4,", ",3.25,4.125,");
    assert!(refused(&waves, &|_| ()).contains("has -9999 at 16 of 36 points, the first in line 1, column 0 (from 0)"));
    assert!(
        refused(&waves, &|spec| spec.missing = missing(&[-9999.0], &[])).contains("has no height at 16 of 36 points")
    );
    // who says that nothing stands for a gap has a deep surface
    assert_eq!(load(&waves, |spec| spec.missing = missing(&[], &[])).unwrap().sample(&[0.0, 0.0]).value, -9999.0);
    assert!(refused("*** ***\n1 2\n3 4\n", &|_| ()).contains("line 1 has no number, but 2 times `***`"));
    assert!(refused("nan nan\nnan nan\n", &|_| ()).contains("has no height at any of its 4 points"));
    assert!(refused("0 0 1\nnan 1 2\n", &|spec| spec.points = true).contains("line 2, column 0 (from 0) is NaN"));
    // a plane is subtracted before gaps are filled
    let tilted = "1,3,5\n0,nan,4\n-1,1,3\n";
    let level = load(tilted, |spec| (spec.detrend, spec.fill) = (Detrend::Plane, Fill::Nearest)).unwrap();
    assert!(level.grid().expect("a grid").values.iter().all(|height| height.abs() < 1e-12), "{level:?}");
    assert!(level.trend().is_some_and(|trend| (trend.slope[0] - 2.0).hypot(trend.slope[1] + 1.0) < 1e-12));
}

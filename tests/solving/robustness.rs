//! Where rounding or a bad start spoiled the answer: columns of two blocks whose pressure a line of algebra gives.

use crate::common::blocks::Blocks;
use crate::common::shapes::SHAPES;
use crate::common::{Run, Scene, case, distance, solve, solve_on};

/// Two unit blocks of modulus `young` on each other, the lower one on a roller; Poisson's ratio is zero, so that each is a
/// spring. `upper` is what holds and loads the upper one.
fn column(young: f64, upper: &str, gap: &str, layer: &str) -> Run {
    solve(blocks([young; 2], [3, 2], upper, gap, layer), &[]).converged()
}

/// The same blocks, each with a modulus and a number of elements along the contact.
fn blocks([lower, young]: [f64; 2], [n1, n2]: [usize; 2], upper: &str, gap: &str, layer: &str) -> Scene {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let text = format!(
        r#"
dimension = 2
mesh = {{ geo = "{geo}", set = {{ rows = 2, n1 = {n1}, n2 = {n2} }} }}

[[body]]
name = "b1"
order = 1
young = {lower:e}
poisson = 0
fix = [{{ on = "b1_bottom", y = 0 }}, {{ on = "b1_left", x = 0 }}]

[[body]]
name = "b2"
order = 1
young = {young:e}
poisson = 0
{upper}

[[contact]]
between = ["b1_top", "b2_bottom"]
gap = "{gap}"
layer = {{ {layer} }}
"#
    );
    Scene::new(text)
}

/// All pressures are `expected` to a share of `accuracy`.
fn assert_pressure(run: &Run, expected: f64, accuracy: f64) {
    for &pressure in &run.contact()["pressure"] {
        assert!((pressure / expected - 1.0).abs() < accuracy, "{pressure:e} instead of {expected:e}");
    }
}

/// A block falls a million times as far as it is compressed: f - K u of that displacement would be rounding.
#[test]
fn a_fall_far_beyond_the_strains() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }]
load = [{ on = "b2_top", pressure = 150 }]"#;
    let run = column(5.3e9, upper, "1.48", "linear = { stiffness = 1e5 }");
    assert_pressure(&run, 150.0, 1e-9);
    let moved = run.contact()["u_n_b2"][0];
    assert!((moved - (1.48 + 150.0 / 1e5)).abs() < 1e-6, "{moved}");
}

/// A support carries a block far, to compress the column by a ten-millionth of that: 2 p / E + p / kappa = 10 - gap. Contact
/// rows of surfaces that do not match have entries with an error of 1e-15, which is 1e-8 of what is left of 10.
#[test]
fn a_support_that_carries_a_block_far() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }, { on = "b2_top", y = -10 }]"#;
    let run = column(1.0, upper, "10 - 2^-20", "linear = { stiffness = 1e3 }");
    assert_pressure(&run, 2.0f64.powi(-20) / (2.0 + 1e-3), 1e-7);
    let moved = run.contact()["u_n_b2"][0];
    assert!((moved - 10.0).abs() < 1e-5, "{moved}");
}

/// A layer that answers the overlap of the start with 1e50 of what the blocks can bear: 2 p / E + B p^a = 5e-4.
#[test]
fn an_overlap_far_too_deep_for_its_law() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }, { on = "b2_top", y = -5e-4 }]"#;
    let (young, b, a) = (5e8, 2e-9, 0.1f64);
    let run = column(young, upper, "0", "power = { B = 2e-9, a = 0.1 }");
    let (mut low, mut high) = (0.0, young);
    for _ in 0..200 {
        let p: f64 = 0.5 * (low + high);
        if 2.0 * p / young + b * p.powf(a) < 5e-4 { low = p } else { high = p }
    }
    assert_pressure(&run, low, 1e-7);
}

/// An overlap that nothing holds together: the solution is no pressure at all, measured by what the overlap could make.
#[test]
fn an_overlap_that_comes_to_nothing() {
    for layer in ["linear = { stiffness = 1e4 }", "power = { B = 1e-5, a = 0.1 }"] {
        let run = column(1e3, r#"fix = [{ on = "b2_left", x = 0 }]"#, "-1e-5", layer);
        assert!(run.contact()["pressure"].iter().all(|&p| p <= 1e-12 * 1e3 * 1e-5), "{layer}");
    }
}

/// Blocks that touch and that nothing presses stay at rest, by every method and in no more than one step.
#[test]
fn blocks_without_a_load() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }]
load = [{ on = "b2_top", pressure = 0 }]"#;
    for gap in ["0", "1e-6*x"] {
        for layer in ["linear = { stiffness = 1e4 }", "power = { B = 3e-6, a = 0.3 }"] {
            for method in ["auto", "newton-robin", "robin"] {
                let scene = blocks([1e3, 1e5], [4, 4], upper, gap, layer);
                let run = solve(scene, &["--method", method, "--set", "method.robin=auto"]).converged();
                assert!(run.count("iterations") <= 1, "{method}: {}", run.said());
                assert!(
                    run.number("pairs/0/peak_pressure") == 0.0 && run.number("F1") == 0.0,
                    "{method}: {}",
                    run.said()
                );
            }
        }
    }
}

/// The upper block pressed down by a support of its top.
fn pressed(depth: f64) -> String {
    format!(r#"fix = [{{ on = "b2_left", x = 0 }}, {{ on = "b2_top", y = -{depth:e} }}]"#)
}

/// The pressure where two blocks and a layer (c/B)^(1/a) share a shortening: p / E1 + p / E2 + B p^a.
fn shared([lower, upper]: [f64; 2], b: f64, a: f64, depth: f64) -> f64 {
    let (mut low, mut high) = (0.0, depth * lower.min(upper));
    for _ in 0..200 {
        let p: f64 = 0.5 * (low + high);
        if p / lower + p / upper + b * p.powf(a) < depth { low = p } else { high = p }
    }
    low
}

/// The corners of the box V9 in kappa h/E and E1/E2: layers a million times softer and stiffer than the softer block, and one
/// block a million times stiffer than the other.
#[test]
fn corners_of_stiffness() {
    for young in [[1.0, 1.0], [1.0, 1e6], [1e6, 1.0]] {
        for kappa in [1e-6, 1.0, 1e6] {
            let expected = shared(young, 1.0 / kappa, 1.0, 1e-3);
            for method in ["auto", "newton", "newton-robin"] {
                let scene =
                    blocks(young, [3, 2], &pressed(1e-3), "0", &format!("linear = {{ stiffness = {kappa:e} }}"));
                assert_pressure(&solve(scene, &["--method", method]).converged(), expected, 1e-6);
            }
        }
    }
}

/// Its corners in the layer of the paper, B and a, on the paper's blocks.
#[test]
fn corners_of_the_law() {
    for (b, a) in [(1e-6, 0.1), (1e-6, 1.0), (2e-4, 0.1), (2e-4, 1.0)] {
        for method in ["auto", "newton", "newton-robin"] {
            let scene = blocks([2.1e5; 2], [3, 2], &pressed(2e-4), "0", &format!("power = {{ B = {b:e}, a = {a} }}"));
            let run = solve(scene, &["--method", method]).converged();
            assert_pressure(&run, shared([2.1e5; 2], b, a, 2e-4), 1e-6);
        }
    }
}

/// Its ends of gamma: right under a soft layer, and under a stiff one, where theta is 0.999, not said to be.
#[test]
fn ends_of_gamma() {
    for gamma in ["0.01", "1.2"] {
        let run = |kappa: f64| {
            let layer = format!("linear = {{ stiffness = {kappa:e} }}");
            let method = format!("method={{gamma={gamma}, stop={{residual=1e-7, iterations=2200}}}}");
            solve(blocks([1.0; 2], [3, 2], &pressed(1e-3), "0", &layer), &["--set", &method])
        };
        assert_pressure(&run(1e-3).converged(), shared([1.0; 2], 1e3, 1.0, 1e-3), 1e-5);
        let stiff = run(1e3);
        assert!(stiff.code == 1 && stiff.number("residual") > 1e-7, "gamma = {gamma}: {}", stiff.text("status"));
    }
}

/// Blocks of two triangles each, on more ranks than there are triangles.
#[test]
fn more_ranks_than_elements() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }]
load = [{ on = "b2_top", pressure = 0.5 }]"#;
    let scene = blocks([100.0; 2], [1, 1], upper, "0", "linear = { stiffness = 300 }");
    let parallel = solve_on(5, scene, &[]).converged();
    assert_eq!(parallel.count("bodies/0/cells") + parallel.count("bodies/1/cells"), 4);
    assert_pressure(&parallel, 0.5, 1e-12);
    assert!(parallel.warnings().contains("3 of 5 ranks have no body"), "{}", parallel.warnings());
}

/// A fall of 10^9 leaves the displacements few digits of what strains the body, and none for the forces that hold it at its side:
/// they are found without the fall.
#[test]
fn forces_are_in_balance_after_any_fall() {
    let held = "fix = [{ on = \"b2_left\", x = 0 }]\nload = [{ on = \"b2_top\", pressure = \"1 + x\" }]";
    for gap in ["1e3", "1e9"] {
        let run = solve(blocks([2.1e5; 2], [3, 2], held, gap, "power = { B = 2.5e-5, a = 0.5 }"), &[]);
        assert_eq!((run.code, run.text("status")), (0, if gap == "1e3" { "converged" } else { "roundoff-limited" }));
        for body in 0..2 {
            let imbalance = run.number(&format!("bodies/{body}/balance/force_imbalance"));
            assert!(imbalance < 1e-7, "gap {gap}, body {body}: {imbalance:e}\n{}", run.said());
        }
        let side = run.number("bodies/1/balance/supports/0/force/0");
        assert!(side.abs() < 1e-6, "{side:e}");
        assert!(run.number("bodies/1/max_von_mises") < 3.0, "{}", run.said());
    }
}

/// A block that falls through a gap of 10^g and is pressed by 0.5 loses g digits of its pressure, and no more: up to where that is less
/// than the tolerance the run is converged, from there on its status and message say what is lost.
#[test]
fn lost_digits_have_their_status() {
    let pressed = "fix = [{ on = \"b2_left\", x = 0 }]\nload = [{ on = \"b2_top\", pressure = 0.5 }]";
    for gap in ["1", "1e3", "1e6", "1e9", "1e12", "1e15"] {
        for method in ["auto", "newton-robin"] {
            let scene = blocks([2.1e5; 2], [3, 2], pressed, gap, "linear = { stiffness = 1e6 }");
            let run = solve(scene, &["--method", method, "--set", "method.stop.iterations=60"]);
            let worst = run.contact()["pressure"].iter().map(|p| (p / 0.5 - 1.0).abs()).fold(0.0, f64::max);
            let warned = run.text("message").contains("few digits are left");
            assert_eq!(run.text("status") == "converged", !warned, "{method}, gap {gap}: {}", run.said());
            // what rounding of the gap makes of a pressure: the layer and half of a cell on either side are springs of 10^5
            let gap: f64 = gap.parse().expect("a number");
            let expected = f64::EPSILON * gap * 1e5 / 0.5;
            assert_eq!(warned, expected > 1e-5, "{method}, gap {gap}: {expected:e}\n{}", run.said());
            assert!(warned || worst < 1e-4, "{method}, gap {gap}: {worst:e}\n{}", run.said());
            assert!(run.code == 0 || warned && !run.text("message").contains("allow more"), "{}", run.said());
        }
    }
}

/// A block that leans on one edge, over a gap as wide as a contact point: whole steps go back and forth between two contacts, since one point resists no
/// turn, and F1 has to say how far the block turns.
#[test]
fn a_leaning_block_comes_to_rest() {
    for lean in [0.8, 0.85, 0.9, 0.93] {
        let upper = format!("load = [{{ on = \"b2_top\", pressure = \"5.7e3 * (1 + {lean} * (2*x - 1))\" }}]");
        let gap = "8.6e-4 * max(0, 1 - ((x - 1) / 0.3)^2)^1.5";
        let scene = blocks([9e7; 2], [2, 8], &upper, gap, "power = { B = 3.6e-13, a = 1 }");
        let run = solve(scene, &[]).converged();
        assert!(run.count("iterations") <= 4, "{lean}: {} steps", run.count("iterations"));
    }
}

/// Three bodies on each other on a mesh of the random scenes: modulus, Poisson's ratio and order of each, the support that keeps the third from
/// sliding, the pressure on it, and what the two contacts have beside their surfaces.
fn three(geo: &str, of: [(&str, &str, u8); 3], held: &str, pressure: &str, contacts: [&str; 2]) -> Scene {
    let supports = [
        r#"fix = [{ on = "b1_bottom", y = 0 }, { on = "b1_left", x = 0 }]"#.to_owned(),
        r#"fix = [{ on = "b2_pin", x = 0 }]"#.to_owned(),
        format!("fix = [{{ on = \"{held}\", x = 0 }}]\nload = [{{ on = \"b3_top\", pressure = {pressure} }}]"),
    ];
    let mut text =
        format!("dimension = 2\nmesh = {{ geo = \"{}/tests/stress/meshes/{geo} }}\n", env!("CARGO_MANIFEST_DIR"));
    for (i, ((young, poisson, order), more)) in (1..).zip(of.into_iter().zip(supports)) {
        text += &format!("[[body]]\nname = \"b{i}\"\nyoung = {young}\npoisson = {poisson}\norder = {order}\n{more}\n");
    }
    for (i, more) in (1..).zip(contacts) {
        text += &format!("[[contact]]\nbetween = [\"b{i}_top\", \"b{}_bottom\"]\n{more}\n", i + 1);
    }
    Scene::new(text)
}

/// The load on the third body goes through both contacts, to a share of 1e-8.
fn assert_carried(run: &Run) {
    let load = -run.number("bodies/2/balance/loads/force/1");
    for pair in 0..2 {
        let force = run.number(&format!("pairs/{pair}/force/1/1"));
        assert!((force / load - 1.0).abs() < 1e-8, "pair {pair}: {force:e} instead of {load:e}");
    }
}

/// Round blocks that touch in one point: nothing resists that they roll. Bodies are moved rigidly between steps, until loads are nearly in balance; what a
/// run reports is in balance.
#[test]
fn blocks_on_one_point_carry_their_load() {
    let scene = three(
        r#"round.geo", set = { R = 1.05, whole = 1, lens = 1, n1 = 6, n2 = 5, n3 = 9 }"#,
        [
            ("2.3242291180960872e5", "0.3", 2),
            ("2.3242291180960872e5", "0.4749161204155611", 1),
            ("2.3242291180960872e5", "0", 1),
        ],
        "b3_pin",
        "2.406644667837266",
        [
            "layer = { power = { B = 4.13978317480803e-11, a = 0.3 } }",
            "gap = \"1.3149934836616322e-2\"\nlayer = { power = { B = 1.8018927164479965e-6, a = 0.5 } }",
        ],
    );
    assert_carried(&solve(scene, &[]).converged());
}

/// A start ten times as far as the blocks are long has pressures of its own, by which no error is measured.
#[test]
fn a_given_start_is_no_measure() {
    let scene = three(
        r#"small.geo", set = { size = 1e-4, three = 1, n = 1 }"#,
        [("870", "0.17", 1), ("870", "0.3", 1), ("2.8", "0.27", 1)],
        "b3_left",
        "7.6e-11",
        [
            "layer = { power = { B = 1.1e-11, a = 0.88 } }",
            "gap = \"1.36e-11\"\nlayer = { power = { B = 2.3e-8, a = 0.5 } }",
        ],
    );
    assert_carried(&solve(scene, &["--set", "method.start={normal=1e-3}"]).converged());
}

/// Weight alone bulges a block against one that is free to move away: the contact vanishes, and is measured by what the blocks carry.
#[test]
fn a_contact_that_vanishes_beside_loads() {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let body = |name: &str, more: &str| {
        format!("[[body]]\nname = \"{name}\"\norder = 1\nyoung = 100\npoisson = 0.4\nforce = [0, -1e-6]\n{more}\n")
    };
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"{geo}\", set = {{ rows = 1, columns = 2, n1 = 5, n2 = 5 }} }}\n{}{}{}",
        body("b1", r#"fix = [{ on = "b1_bottom", y = 0 }, { on = "b1_left", x = 0 }]"#),
        body("b2", r#"fix = [{ on = "b2_bottom", y = 0 }]"#),
        "[[contact]]\nbetween = [\"b1_right\", \"b2_left\"]\nlayer = { pressure = \"1e6*c^2/(c + 1e-10)\" }\n"
    );
    let run = solve(Scene::new(text), &[]).converged();
    // 6; 20 if the free block is not moved to where nothing is pressed
    assert!(run.count("iterations") <= 10, "{}", run.said());
    let largest = run.contact()["pressure"].iter().copied().fold(0.0, f64::max);
    assert!(largest < 1e-6 * 1e-6, "{largest:e}");
}

/// Further steps at the rounding floor make no progress: the run ends after three of them.
#[test]
fn a_run_that_rounding_ends_is_soon_over() {
    let run = solve(
        concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/groove-held/scene.toml"),
        &["--set", "method={stop={residual=1e-16}}", "--set", "mesh.set.n=16"],
    );
    assert_eq!((run.code, run.text("status")), (0, "roundoff-limited"), "{}", run.said());
    assert!(run.number("residual") < 1e-12 && run.count("iterations") <= 12, "{}", run.said());
}

/// A support that draws blocks together over a far overlap, or a far gap, leaves no more digits than `rounding` says.
#[test]
fn far_overlaps_have_their_error() {
    for gap in ["-1e4", "-1e8", "1e8", "-1e10", "-1e12"] {
        let args = ["mesh.set.n=4", "method={}", &format!("contact.0.gap={gap}")];
        let args: Vec<&str> = args.iter().flat_map(|set| ["--set", set]).collect();
        let run = solve(case("groove-held"), &args);
        let off = (run.number("pairs/0/peak_pressure") / 10.0 - 1.0).abs();
        assert!(run.code != 0 || off <= run.number("rounding") + 1e-6, "{gap}: {off:e}, {}", run.said());
        assert_eq!(run.code == 0 && run.text("status") == "converged", gap == "-1e4", "{gap}: {}", run.said());
    }
}

/// Solvers have thresholds: MUMPS takes pivots below 1e-20 for zeros, and residuals below 1e-50 were none. Units change nothing but the last digits.
#[test]
fn units_are_the_users_choice() {
    let two = |exponent| 2f64.powi(exponent);
    let units = [(two(-74), 1.0), (two(-100), two(-66)), (1e9, 1e-9), (1e-40, 1e30), (1e44, 1e-35)];
    for (shape, condensed) in SHAPES.iter().zip([true, false, true]) {
        let all = [
            "solver=condensed",
            "solver=mumps",
            "solver=hypre",
            "method.name=newton-robin",
            "method={gamma=\"aitken\",robin=\"auto\"}",
        ];
        for set in &all[..if condensed { 5 } else { 3 }] {
            let expected = shape.pressures(1.0, 1.0, set);
            for (stress, length) in units {
                let off = distance(&shape.pressures(stress, length, set), &expected);
                assert!(off < 1e-8, "{}, {set}, {stress:e}, {length:e}: {off:e}", shape.script);
            }
        }
    }
}

/// What double precision cannot carry is refused by its own name and line, and for what it is.
#[test]
fn numbers_beyond_any_unit_are_refused() {
    let refused = |stress: f64, length: f64, code: i32, words: &[&str]| {
        let run = solve(SHAPES[0].scene(stress, length, "linear = { stiffness = 1e6 }"), &[]);
        assert_eq!(run.code, code, "{}", run.said());
        assert!(words.iter().all(|words| run.stderr.contains(words)), "{words:?}: {}", run.said());
    };
    let modulus = ["body `lower`: young is 2.", "must lie between 1e-50 and 1e50", "scene.toml:4:"];
    refused(1e100, 1.0, 3, &modulus);
    refused(1e-60, 1.0, 3, &modulus);
    refused(1e300, 1.0, 3, &["no run computes with a number like", "choose other units", "scene.toml:4:"]);
    refused(1.0, 1e-60, 4, &["the mesh is 4.0e-60 long", "another unit of length"]);
    refused(1.0, 1e60, 4, &["the mesh is 4.0e60 long", "another unit of length"]);
}

/// A load of 1e-100 moves a block through the flat foot of its law 1e41 times as far as the springs of the first step would.
#[test]
fn tiny_loads_are_loads() {
    for (layer, accuracy) in [("linear = { stiffness = 1e6 }", 1e-8), ("power = { B = 2.5e-5, a = 0.5 }", 1e-8)] {
        let upper = "fix = [{ on = \"b2_left\", x = 0 }]\nload = [{ on = \"b2_top\", pressure = 1e-100 }]";
        assert_pressure(&column(1e3, upper, "0", layer), 1e-100, accuracy);
    }
}

/// Compressions of layers that are as good as rigid have no digit left in displacements: what is said of the error covers it.
#[test]
fn stiff_layers_have_their_error() {
    let of = |run: &Run| run.number("residual") + run.number("rounding");
    for shape in &SHAPES[..2] {
        let solved = |stiffness: f64| {
            let run = solve(shape.scene(1.0, 1.0, &format!("linear = {{ stiffness = {stiffness:e} }}")), &[]);
            let pressure = run.contact()["pressure"].to_vec();
            (run, pressure)
        };
        // the layer's own share falls with its compliance
        let [soft, stiff] = [1e11, 1e12].map(|stiffness| solved(stiffness).1);
        let limit: Vec<f64> = soft.iter().zip(&stiff).map(|(soft, stiff)| stiff + (stiff - soft) / 9.0).collect();
        let peak = limit.iter().copied().fold(0.0, f64::max);
        for stiffness in [1e14, 1e16, 1e17, 1e18, 1e19, 1e20] {
            let (run, pressure) = solved(stiffness);
            let off = pressure.iter().zip(&limit).map(|(p, limit)| (p - limit).abs()).fold(0.0, f64::max) / peak;
            assert!(run.code != 0 || off < of(&run) + 1e-7, "{}, {stiffness:e}: {off:e}, {}", shape.script, run.said());
        }
    }
    let upper = "fix = [{ on = \"b2_left\", x = 0 }]\nload = [{ on = \"b2_top\", pressure = 150 }]";
    for stiffness in ["1e12", "1e16", "1e18", "1e20"] {
        for method in ["newton", "newton-robin"] {
            let scene = blocks([1e5; 2], [3, 2], upper, "1e-3", &format!("linear = {{ stiffness = {stiffness} }}"));
            let run = solve(scene, &["--method", method]);
            let off = run.contact()["pressure"].iter().map(|p| (p / 150.0 - 1.0).abs()).fold(0.0, f64::max);
            assert!(run.code != 0 || off < of(&run) + 1e-12, "{method}, {stiffness}: {off:e}, {}", run.said());
        }
    }
}

/// Multigrid of two small blocks on a stiff layer, the upper one held sideways by soft springs: rows near the contact
/// are most of all rows. It takes at most as many iterations as there are dofs, for the pressures of a factorisation.
#[test]
fn multigrid_of_a_small_mesh_on_a_stiff_layer() {
    let mut mesh = Blocks::default();
    mesh.add("lo", 3, 1, 2, |[x, y, z]| [x, y, 0.6 * z - 0.6]);
    mesh.add("up", 3, 1, 2, |[x, y, z]| [x + 0.15, 0.9 * y, 0.59 * z + 0.01]);
    let scene = Scene::new(
        r#"
dimension = 3
mesh = "blocks.msh"
[[body]]
name = "lo"
order = 1
young = 7000
poisson = 0.3
fix = [{ on = "lo_low", x = 0, y = 0, z = 0 }]
[[body]]
name = "up"
order = 1
young = 17061
poisson = 0.3
load = [{ on = "up_high", force = [0, 0, -0.95], moment = [0.0476, 0.0286, 0], rigid = true }]
spring = [{ on = "up_side", stiffness = [1, 1, 0] }]
[[contact]]
between = ["lo_high", "up_low"]
touching = true
layer = { linear = { stiffness = 1e7 } }
"#,
    );
    std::fs::write(scene.path.with_file_name("blocks.msh"), mesh.text(1, |x| x.to_string())).expect("a mesh");
    let run = |ranks: usize, solver: &str| solve_on(ranks, &scene, &["--set", solver]).converged();
    let exact = run(1, "solver=mumps");
    for ranks in [1, 2] {
        let found = run(ranks, "solver=hypre");
        assert!(found.count("inner_iterations") <= found.count("dofs"), "{}", found.count("inner_iterations"));
        assert!(distance(&found.contact()["pressure"], &exact.contact()["pressure"]) < 1e-6);
    }
}

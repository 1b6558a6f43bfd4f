//! Layers that saturate: their tangents nearly vanish, so that a step of Newton's method may lead a million times too far.

use crate::common::{Run, Scene, case, solve, solve_on};
use tempfile::TempDir;

/// Two blocks, of which contact alone holds the upper one along the load: its width and height, elements along both contacts and through both heights, and
/// the rest of the scene.
struct Punch {
    upper: [f64; 2],
    elements: [usize; 4],
    scene: &'static str,
}

impl Punch {
    /// Solve with these arguments.
    fn solve(&self, args: &[&str]) -> Run {
        let folder = TempDir::new().expect("a temporary folder");
        let ([width, height], [n1, m1, n2, m2]) = (self.upper, self.elements);
        let block = |name: &str, first: usize, [x, y, top]: [f64; 3], [n, m]: [usize; 2]| {
            let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
            format!(
                "Point({a}) = {{0, {y}, 0}}; Point({b}) = {{{x}, {y}, 0}}; Point({c}) = {{{x}, {top}, 0}}; Point({d}) = {{0, {top}, 0}};\n\
                 Line({a}) = {{{a}, {b}}}; Line({b}) = {{{b}, {c}}}; Line({c}) = {{{c}, {d}}}; Line({d}) = {{{d}, {a}}};\n\
                 Curve Loop({a}) = {{{a}, {b}, {c}, {d}}}; Plane Surface({a}) = {{{a}}};\n\
                 Transfinite Curve {{{a}, {c}}} = {n} + 1; Transfinite Curve {{{b}, {d}}} = {m} + 1; Transfinite Surface {{{a}}};\n\
                 Physical Surface(\"{name}\") = {{{a}}}; Physical Curve(\"{name}_bottom\") = {{{a}}};\n\
                 Physical Curve(\"{name}_top\") = {{{c}}}; Physical Curve(\"{name}_left\") = {{{d}}};\n"
            )
        };
        let script = block("lo", 101, [2.0, -1.0, 0.0], [n1, m1]) + &block("up", 201, [width, 0.0, height], [n2, m2]);
        let geo = folder.path().join("punch.geo");
        std::fs::write(&geo, script).expect("a script can be written");
        solve(Scene::new(format!("dimension = 2\nmesh = \"{}\"\n{}", geo.display(), self.scene)), args)
    }
}

/// Contact alone holds a punch of revolution.
const ROUND: Punch = Punch {
    upper: [0.7, 0.7],
    elements: [12, 6, 6, 3],
    scene: r#"plane = "axisymmetric"
[[body]]
name = "lo"
order = 1
young = 3511.6364540865293
poisson = 0.3
fix = [{ on = "lo_bottom", y = 0 }, { on = "lo_left", x = 0 }]
[[body]]
name = "up"
order = 1
young = 62559.32605892774
poisson = 0.3
load = [{ on = "up_top", pressure = "2.009317369043762*(1 - 0.0192458454741693*x)" }]
[[contact]]
between = ["lo_top", "up_bottom"]
gap = "0.0004007480195905918*sin(11.08130768556358*x)"
layer = { table = [[6.532e-8, 2.64864604], [10, 2.65453069683]] }
"#,
};

/// The steps lead far, and descents lead back: displacements, gaps and pressures are those of one state then.
#[test]
fn displacements_belong_to_the_pressures() {
    let run = ROUND.solve(&[]).converged();
    let near = |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-6, "{value:e}, {}", run.said());
    near(run.number("pairs/0/approach"), 6.271389120e-4);
    near(run.number("pairs/0/peak_pressure"), 2.6486468988);
    let energy = &run.history()["energy"];
    near(energy[energy.len() - 1], -2.783007384e-4);
    let table = run.contact();
    for q in 0..table.rows() {
        let closed = table["u_n_lo"][q] + table["u_n_up"][q] - table["gap"][q];
        assert!((table["compression"][q] - closed).abs() < 1e-12, "{q}: {closed:e}, {}", run.said());
    }
}

/// Scenes in which Newton's method ran in a cycle, or ended far from the solution, with their largest pressure by load steps.
#[test]
fn steps_that_lead_too_far_do_not_repeat() {
    let scenes = [
        (
            5.7623408612,
            Punch {
                upper: [1.0, 0.7],
                elements: [12, 6, 6, 3],
                scene: r#"plane = "axisymmetric"
[[body]]
name = "lo"
order = 1
young = 7000
poisson = 0.3
fix = [{ on = "lo_bottom", y = 0 }, { on = "lo_left", x = 0 }]
[[body]]
name = "up"
order = 1
young = 90000
poisson = 0.3
load = [{ on = "up_top", pressure = 3.992725970947909 }]
[[contact]]
between = ["lo_top", "up_bottom"]
gap = "0.0009498268470886574*sin(12.961006859154201*x)"
layer = { table = [[1.657e-4, 5.76234], [100, 5.78743376]] }
"#,
            },
        ),
        (
            4.8957966325,
            Punch {
                upper: [1.0, 0.7],
                elements: [8, 4, 4, 2],
                scene: r#"plane = "stress"
[[body]]
name = "lo"
order = 1
young = 555.9666467349757
poisson = 0.3
fix = [{ on = "lo_bottom", y = 0 }, { on = "lo_left", x = 0 }]
[[body]]
name = "up"
order = 1
young = 13395.220586773656
poisson = 0.3
fix = [{ on = "up_left", x = 0 }]
load = [{ on = "up_top", pressure = 3.541691673702374 }]
[[contact]]
between = ["lo_top", "up_bottom"]
gap = "0.010516843143944543*sin(17.112330283442404*x)"
layer = { table = [[7.977e-4, 4.89579638], [10, 4.89585471255]] }
"#,
            },
        ),
        (
            5.4341606478,
            Punch {
                upper: [0.7, 0.7],
                elements: [16, 8, 8, 4],
                scene: r#"plane = "stress"
[[body]]
name = "lo"
order = 1
young = 2637.351256909551
poisson = 0.3
fix = [{ on = "lo_bottom", y = 0 }, { on = "lo_left", x = 0 }]
[[body]]
name = "up"
order = 1
young = 97006.8181627533
poisson = 0.3
fix = [{ on = "up_left", x = 0 }]
load = [{ on = "up_top", pressure = "3.0006744440314814*(1 + 0.26095078805422467*x)" }]
[[contact]]
between = ["lo_top", "up_bottom"]
gap = "0.0004621548654781877*sin(16.102011710682415*x)"
layer = { table = [[4.190e-6, 5.43416058], [10, 5.43450102458]] }
"#,
            },
        ),
        (
            3.5463898816,
            Punch {
                upper: [1.5, 0.7],
                elements: [12, 6, 6, 3],
                scene: r#"[[body]]
name = "lo"
order = 1
young = 69893.8089457831
poisson = 0.3
fix = [{ on = "lo_bottom", y = 0 }, { on = "lo_left", x = 0 }]
[[body]]
name = "up"
order = 1
young = 561.9440542101815
poisson = 0.3
fix = [{ on = "up_left", x = 0 }]
load = [{ on = "up_top", pressure = 2.8770957334186416 }]
[[contact]]
between = ["lo_top", "up_bottom"]
gap = "0.012105983677673406*sin(3.7356585895904586*x)"
layer = { table = [[1.4e-6, 3.54637463], [0.1, 3.54642262977]] }
"#,
            },
        ),
        (
            2.2321309804,
            Punch {
                upper: [0.7, 0.8],
                elements: [5, 3, 7, 3],
                scene: r#"[[body]]
name = "lo"
young = 7000
poisson = 0.3
order = 1
fix = [{ on = "lo_bottom", y = 0 }, { on = "lo_left", x = 0 }]
[[body]]
name = "up"
young = 16672.047305703956
poisson = 0.3
order = 2
fix = [{ on = "up_left", x = 0 }]
[[contact]]
between = ["lo_top", "up_bottom"]
gap = "0.002377726804637372*x^2"
layer = { exponential = { p0 = 3.19128, c0 = 2.97404e-6 } }
[[contact]]
on = "up_top"
obstacle = true
gap = "0.002377726804637372*(x - 0.35)^2"
force = 0.20118141933901473
moment = -0.0026186343659001677
layer = { table = [[1.58822e-7, 3.4243742], [0.013704, 6.42992162]] }
"#,
            },
        ),
    ];
    for (peak, punch) in scenes {
        let run = punch.solve(&[]).converged();
        let pairs = run["pairs"].as_array().expect("pairs").len();
        let found = (0..pairs).map(|pair| run.number(&format!("pairs/{pair}/peak_pressure"))).fold(0.0, f64::max);
        assert!((found / peak - 1.0).abs() < 1e-7, "{found}, {}", run.said());
        assert!(run.count("iterations") <= 100, "{}", run.said());
    }
}

/// An obstacle turns a body about an axis that a saturated layer hardly resists: what eliminates the obstacle around multigrid has to know that resistance.
#[test]
fn no_solver_changes_the_answer() {
    let folder = TempDir::new().expect("a temporary folder");
    let geo = folder.path().join("blocks.geo");
    let block = |name: &str, first: usize, [x, y, z]: [f64; 3], [width, depth, height]: [f64; 3]| {
        let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
        let (x1, y1) = (x + width, y + depth);
        format!(
            "Point({a}) = {{{x}, {y}, {z}}}; Point({b}) = {{{x1}, {y}, {z}}}; Point({c}) = {{{x1}, {y1}, {z}}}; Point({d}) = {{{x}, {y1}, {z}}};\n\
             Line({a}) = {{{a}, {b}}}; Line({b}) = {{{b}, {c}}}; Line({c}) = {{{c}, {d}}}; Line({d}) = {{{d}, {a}}};\n\
             Curve Loop({a}) = {{{a}, {b}, {c}, {d}}}; Plane Surface({a}) = {{{a}}};\n\
             Transfinite Curve {{{a}, {b}, {c}, {d}}} = 3; Transfinite Surface {{{a}}};\n\
             {name}[] = Extrude {{0, 0, {height}}} {{ Surface{{{a}}}; Layers{{2}}; }};\n\
             Physical Volume(\"{name}\") = {{{name}[1]}}; Physical Surface(\"{name}_bottom\") = {{{a}}};\n\
             Physical Surface(\"{name}_top\") = {{{name}[0]}}; Physical Surface(\"{name}_side\") = {{{name}[2]}};\n"
        )
    };
    let script =
        block("lo", 1001, [0.0, 0.0, -0.6], [1.0, 1.0, 0.6]) + &block("up", 2001, [0.15, 0.0, 0.01], [1.0, 0.9, 0.59]);
    std::fs::write(&geo, script).expect("a script can be written");
    let scene = Scene::new(format!(
        r#"dimension = 3
mesh = "{}"
[[body]]
name = "lo"
young = 7000
poisson = 0.3
order = 1
fix = [{{ on = "lo_bottom", x = 0, y = 0, z = 0 }}]
[[body]]
name = "up"
young = 13184.720865553818
poisson = 0.3
order = 2
fix = [{{ on = "up_side", y = 0 }}]
spring = [{{ on = "up_side", stiffness = [1, 1, 0] }}]
[[contact]]
between = ["lo_top", "up_bottom"]
touching = true
gap = "1e-4*cos(5*x)*cos(3*y)"
layer = {{ table = [[1e-4, 3], [1, 4]] }}
[[contact]]
on = "up_top"
obstacle = true
gap = "1e-3*((x - 0.65)^2 + (y - 0.45)^2)"
force = 2.9022287260507467
moment = [0.11608914904202987, -0.0870667618215224, 0]
layer = {{ linear = {{ stiffness = 1e5 }} }}
"#,
        geo.display()
    ));
    let peaks = |run: &Run| [0, 1].map(|pair| run.number(&format!("pairs/{pair}/peak_pressure")));
    let exact = peaks(&solve(&scene, &["--set", "solver=mumps"]).converged());
    for ranks in [1, 2] {
        let run = solve_on(ranks, &scene, &["--set", "solver=hypre"]).converged();
        let near = peaks(&run).iter().zip(&exact).all(|(p, exact)| (p / exact - 1.0).abs() < 1e-5);
        assert!(near && run.count("iterations") <= 12, "{exact:?}, {}", run.said());
    }
}

/// Forces of a run balance to six digits, on its own mesh as on adapted ones.
#[test]
fn forces_balance_on_adapted_meshes() {
    let held = ["--set", "mesh.set.n=4", "--set", "method={}"];
    let title = format!("title=balance {}", crate::common::nanoseconds());
    for (name, args, load) in [("groove-held", &held[..], 40.0), ("hertz-line", &[], 960.0)] {
        for tolerance in [&[][..], &["--tolerance", "5e-2", "--set", &title]] {
            let run = solve(case(name), &[args, tolerance].concat());
            assert!(run.number("residual") <= 1e-8, "{}", run.said());
            for body in 0..2 {
                let imbalance = run.number(&format!("bodies/{body}/balance/force_imbalance"));
                assert!(imbalance < 1e-6, "{imbalance}, {}", run.said());
            }
            let carried = run.forces(0)[0].iter().map(|f| f * f).sum::<f64>().sqrt();
            assert!((carried / load - 1.0).abs() < 1e-6, "{carried}, {}", run.said());
        }
    }
}

/// A tolerance that roundoff does not allow ends the run after a few more steps, though a descent makes many of them.
#[test]
fn a_tolerance_below_roundoff_ends_soon() {
    let text = r#"dimension = 2
mesh = { geo = "meshes/groove/groove.geo", set = { n = 12 } }
[[body]]
name = "lower"
young = 1.097571e4
poisson = -0.3
order = 1
fix = [{ on = "lower_axis", x = 0 }, { on = "lower_face", y = 0 }]
[[body]]
name = "upper"
young = 8.962066e3
poisson = -0.3
order = 2
fix = [{ on = "upper_axis", x = 0 }]
load = [{ on = "upper_face", pressure = 3.104423e0 }]
[[contact]]
between = ["lower_top", "upper_bottom"]
gap = "1.182696e-4*sin(1.380326e1*x) + 7.629726e-5*x^2"
layer = { table = [[1.769337e-5, 1e-6], [1.199203e-2, 2.5e0], [1.199286e-2, 5e0], [1.011992e0, 5.000000001868e0]] }
"#;
    let text = text.replace("meshes/", concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/"));
    let run = solve(Scene::new(text), &["--set", "method.stop.residual=1e-14", "--set", "method.stop.iterations=3000"]);
    assert!(run.number("iterations") < 100.0 && run.number("error_bound") < 1e-9, "{}", run.said());
}

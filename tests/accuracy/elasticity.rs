//! Elasticity of the bodies: any constants, in any axes, by region and by place, through the whole program.

use crate::common::here::solve_here;
use crate::common::{Report, Scene, case, solve, solve_on, text_of};

/// Solves a scene with `--set` for each of these.
fn solve_set(scene: impl AsRef<std::path::Path>, sets: &[String]) -> Report {
    solve_here(scene, &sets.iter().map(String::as_str).collect::<Vec<_>>())
}

fn near(found: f64, exact: f64, tolerance: f64) -> bool {
    (found / exact - 1.0).abs() < tolerance
}

/// Compliance against pressure across fibres at an angle, by the formulas of composites; `held`: plane strain.
fn across_fibres(angle: f64, held: bool) -> f64 {
    let (e1, e2, e3, nu12, nu13, nu23, g12) = (1.4e5, 1e4, 1e4, 0.3, 0.3, 0.45, 5e3);
    let (mut s11, mut s22, mut s12) = (1.0 / e1, 1.0 / e2, -nu12 / e1);
    if held {
        // eps_3 = 0: sigma_3 = (nu13 E3/E1) sigma_1 + (nu23 E3/E2) sigma_2
        let (s13, s23) = (-nu13 / e1, -nu23 / e2);
        s11 -= s13 * s13 * e3;
        s22 -= s23 * s23 * e3;
        s12 -= s13 * s23 * e3;
    }
    let (s, c) = angle.to_radians().sin_cos();
    s11 * s.powi(4) + (2.0 * s12 + 1.0 / g12) * (s * c).powi(2) + s22 * c.powi(4)
}

/// Blocks of oblique fibres shorten by their compliance across the fibres, in both plane states, to rounding.
#[test]
fn oblique_fibres() {
    for plane in ["strain", "stress"] {
        for order in [1, 2] {
            let mut sets: Vec<String> = (0..2).map(|body| format!("body.{body}.order={order}")).collect();
            sets.push(format!("plane={plane}"));
            let table = solve_set(case("anisotropic"), &sets).converged().contact();
            let [lower, upper] = [35.0, 50.0].map(|angle| 10.0 * across_fibres(angle, plane == "strain"));
            for q in 0..table.rows() {
                assert!(near(table["pressure"][q], 10.0, 1e-9), "{plane} P{order}: {}", table["pressure"][q]);
                assert!(near(table["u_n_lower"][q], -lower, 1e-9), "{plane}: {} {lower}", table["u_n_lower"][q]);
            }
            // the face of the upper block goes down by both blocks and the layer
            let closing = 10.0 / 1e5;
            let energy = -0.5 * 10.0 * (lower + upper + closing);
            let run = solve_set(case("anisotropic"), &sets);
            assert!(near(run.number("F1"), energy, 1e-9), "{plane}: {} {energy}", run.number("F1"));
        }
    }
}

/// Cubes of oblique fibres: the compliance along z by the formula of an orthotropic body in any direction.
#[test]
fn oblique_fibres_in_space() {
    let (e, nu12, nu13, nu23) = ([1.4e5, 1e4, 8e3], 0.3, 0.25, 0.45);
    let (g12, g13, g23) = (5e3, 4e3, 3.4e3);
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| a[c] * b[c]).sum::<f64>();
    let unit = |v: [f64; 3]| v.map(|c| c / dot(v, v).sqrt());
    let compliance = |first: [f64; 3], second: [f64; 3]| {
        let first = unit(first);
        let along = dot(first, second);
        let second = unit(std::array::from_fn(|c| second[c] - along * first[c]));
        // squared cosines between z and the axes
        let (l, m) = (first[2].powi(2), second[2].powi(2));
        let n = 1.0 - l - m;
        l * l / e[0]
            + m * m / e[1]
            + n * n / e[2]
            + l * m * (1.0 / g12 - 2.0 * nu12 / e[0])
            + l * n * (1.0 / g13 - 2.0 * nu13 / e[0])
            + m * n * (1.0 / g23 - 2.0 * nu23 / e[1])
    };
    let lower = 10.0 * compliance([2.0, 1.0, 2.0], [0.0, 1.0, 0.0]);
    let upper = 10.0 * compliance([1.0, -2.0, 3.0], [1.0, 0.0, 0.0]);
    let run = solve_here(case("anisotropic-3d"), &[]).converged();
    let table = run.contact();
    for q in 0..table.rows() {
        assert!(near(table["pressure"][q], 10.0, 1e-9), "{}", table["pressure"][q]);
        assert!(near(table["u_n_lower"][q], -lower, 1e-9), "{} {lower}", table["u_n_lower"][q]);
    }
    let energy = -0.5 * 10.0 * (lower + upper + 10.0 / 1e5);
    assert!(near(run.number("F1"), energy, 1e-9), "{} {energy}", run.number("F1"));
}

/// A uniaxial state given one per cent too large is wrong by 0.01/1.01 in every norm, and its stresses are known.
#[test]
fn known_displacements_and_stresses() {
    let given: Vec<String> = ["0.3*x", "0.3*y", "-z"].iter().map(|u| format!("\"1.01*10/2.1e5*({u})\"")).collect();
    let sets = [format!("body.0.exact=[{}]", given.join(", "))];
    let run = solve_set(case("patch-3d"), &sets).converged();
    for norm in ["error_l2", "error_h1", "error_energy"] {
        let error = run.number(&format!("bodies/0/{norm}"));
        assert!(near(error, 0.01 / 1.01, 1e-8), "{norm} {error}");
        assert!(run["bodies"][1][norm].is_null());
    }
    for body in 0..2 {
        let stress = |key: &str| run.number(&format!("bodies/{body}/{key}"));
        assert!(near(stress("max_von_mises"), 10.0, 1e-9));
        assert!(stress("principal_range/0").abs() < 1e-8 && near(stress("principal_range/1"), -10.0, 1e-9));
        let height = stress("max_von_mises_at/2");
        assert!((body as f64..=body as f64 + 1.0).contains(&height), "{height}");
    }
}

/// The same blocks by their 21 constants, and in axes given in another way: the same run.
#[test]
fn one_material_in_several_words() {
    let reference = solve_here(case("anisotropic"), &[]).converged();
    let orthotropic = "orthotropic={E1=1.4e5,E2=1e4,E3=1e4,nu12=0.3,nu13=0.3,nu23=0.45,G12=5e3,G13=5e3,G23=3.4e3}";
    // C of this composite, by inverting its compliance
    let (s11, s12, s22, s23) = (1.0 / 1.4e5, -0.3 / 1.4e5, 1e-4, -0.45e-4);
    let det = s11 * (s22 + s23) - 2.0 * s12 * s12;
    let (c11, c12) = ((s22 + s23) / det, -s12 / det);
    let (sum, difference) = (s11 / det, 1.0 / (s22 - s23));
    let (c22, c23) = (0.5 * (sum + difference), 0.5 * (sum - difference));
    let c = format!("[{c11},{c12},{c12},0,0,0, {c22},{c23},0,0,0, {c22},0,0,0, 3.4e3,0,0, 5e3,0, 5e3]");
    let lines =
        |text: &str| text.lines().filter(|line| !line.starts_with("orthotropic")).collect::<Vec<_>>().join("\n");
    let by_stiffness =
        Scene::new(lines(&text_of("anisotropic")).replace("[[body]]\n", &format!("[[body]]\nanisotropic = {c}\n")));
    let spaced = orthotropic.replacen('=', " = ", 1);
    let vectors =
        Scene::new(lines(&text_of("anisotropic")).replace("[[body]]\n", &format!("[[body]]\n{spaced}\n")).replace(
            "{ angle = \"35*pi/180\" }",
            "{ first = [\"cos(35*pi/180)\", \"sin(35*pi/180)\", 0], second = [0, \"1 + 0*x\", 0] }",
        ));
    for scene in [by_stiffness, vectors] {
        let run = solve_here(&scene, &[]).converged();
        assert_eq!(run.count("iterations"), reference.count("iterations"));
        assert!(near(run.number("F1"), reference.number("F1"), 1e-11), "{}", run.number("F1"));
    }
}

/// A block whose modulus falls with height, E = E0/(1 + y): quadratic displacements, exact with P2; nu = 0.
#[test]
fn graded_block() {
    let mut sets: Vec<String> =
        (0..2).flat_map(|b| [format!("body.{b}.order=2"), format!("body.{b}.poisson=0")]).collect();
    sets.push("body.0.young=2.1e5/(1 + y)".into());
    let table = solve_set(case("patch"), &sets).converged().contact();
    // q times the integral of (1 + y)/E0
    let shortening = 10.0 * 1.5 / 2.1e5;
    assert!(table["u_n_lower"].iter().all(|u| near(*u, -shortening, 1e-9)), "{:?}", &table["u_n_lower"]);
}

/// The lower block with a core between y = 0.25 and 0.75.
const LAYERED: &str = r#"
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 0.25, 0}; Point(4) = {0, 0.25, 0};
Point(5) = {1, 0.75, 0}; Point(6) = {0, 0.75, 0}; Point(7) = {1, 1, 0}; Point(8) = {0, 1, 0};
Point(11) = {0, 1, 0}; Point(12) = {1, 1, 0}; Point(13) = {1, 2, 0}; Point(14) = {0, 2, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Line(5) = {3, 5}; Line(6) = {5, 6}; Line(7) = {6, 4};
Line(8) = {5, 7}; Line(9) = {7, 8}; Line(10) = {8, 6};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 11};
Curve Loop(1) = {1, 2, 3, 4}; Curve Loop(2) = {-3, 5, 6, 7}; Curve Loop(3) = {-6, 8, 9, 10};
Curve Loop(4) = {11, 12, 13, 14};
Plane Surface(1) = {1}; Plane Surface(2) = {2}; Plane Surface(3) = {3}; Plane Surface(4) = {4};
Mesh.MeshSizeMax = 0.3;
Physical Surface("lower") = {1, 2, 3};
Physical Surface("core") = {2};
Physical Surface("half") = {1, 2};
Physical Surface("upper") = {4};
Physical Curve("lower_face") = {1};
Physical Curve("lower_top") = {9};
Physical Curve("upper_face") = {13};
Physical Curve("upper_bottom") = {11};
Physical Point("lower_pin") = {1};
Physical Point("upper_pin") = {14};
"#;

/// The patch on the layered mesh with these lines behind the lower body.
fn layered(regions: &str) -> (Scene, tempfile::TempDir) {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let script = folder.path().join("layered.geo");
    std::fs::write(&script, LAYERED).expect("a script");
    let text = text_of("patch").replace("poisson = 0.3", "poisson = 0");
    let mesh = text.lines().find(|line| line.starts_with("mesh =")).expect("a mesh").to_owned();
    let text = text.replace(&mesh, &format!("mesh = \"{}\"", script.display()));
    let (first, rest) = text.split_once("[[body]]\nname = \"upper\"").expect("two bodies");
    (Scene::new(format!("{first}{regions}\n[[body]]\nname = \"upper\"{rest}")), folder)
}

#[test]
fn regions() {
    let (scene, _script) = layered("[[body.region]]\non = \"core\"\nyoung = 7e4\npoisson = 0\n");
    let run = solve_here(&scene, &[]).converged();
    // cells that another rank has read have the constants of their region, too
    let distributed = solve_on(3, &scene, &["--method", "newton", "--set", "solver=mumps"]).converged();
    let shortening = 10.0 * (0.5 / 2.1e5 + 0.5 / 7e4);
    for table in [run.contact(), distributed.contact()] {
        assert!(table["u_n_lower"].iter().all(|u| near(*u, -shortening, 1e-9)), "{:?}", &table["u_n_lower"]);
    }
    assert_eq!(run.pointer("/settings/body/0/region/0/on").and_then(|on| on.as_str()), Some("core"));
}

fn refused(scene: &Scene, words: &[&str]) {
    let run = solve(scene, &[]);
    assert_eq!(run.code, 3, "{}", run.said());
    for word in words {
        assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said());
    }
    assert!(run.stderr.contains('^'), "no caret\n{}", run.stderr);
}

#[test]
fn regions_that_cannot_be() {
    let region = |on: &str| format!("[[body.region]]\non = \"{on}\"\nyoung = 7e4\npoisson = 0\n");
    refused(&layered(&region("cor")).0, &["no group of cells `cor` for this region", "did you mean `core`?"]);
    refused(&layered(&region("upper")).0, &["`upper` does not touch body `lower`"]);
    refused(&layered(&(region("core") + &region("half"))).0, &["the regions `core` and `half` share the cell at ("]);
}

/// (4): what is not positive definite is refused with body, place and least eigenvalue.
#[test]
fn materials_that_cannot_be() {
    let patch = |from: &str, to: &str| Scene::new(text_of("patch").replacen(from, to, 1));
    let young = |to: &str| patch("young = 2.1e5", &format!("young = {to}"));
    refused(&young("\"2.1e5 * (x - 0.5)\""), &["body `lower`: young is -", " at (", "greater than 0"]);
    refused(&patch("poisson = 0.3", "poisson = \"0.3 + y\""), &["body `lower`: poisson is 0.", "between -1 and 0.5"]);
    refused(&young("\"1/(x - x)\""), &["young is not a finite number at x = ", "gives inf there"]);
    let own = "young = 2.1e5\npoisson = 0.3";
    let fibres = |nu23: &str, axes: &str| {
        let constants = format!("E1=1.4e5, E2=1e4, E3=1e4, nu12=0.3, nu13=0.3, nu23={nu23}, G12=5e3, G13=5e3, G23=3e3");
        patch(own, &format!("orthotropic = {{ {constants} }}\n{axes}"))
    };
    let definite = "body `lower`: the elasticity tensor is not positive definite";
    refused(&fibres("1.1", ""), &[definite, "the least eigenvalue of C is -"]);
    refused(&fibres("\"0.4 + x\"", ""), &[definite, " at (", "the least eigenvalue of C is -"]);
    refused(&fibres("0.4", "axes = { first = [0, 0] }"), &["body `lower`: axes: `first` has no direction"]);
    let zero = "axes = { first = [1, 1], second = [2, 2] }";
    refused(&fibres("0.4", zero), &["`first` and `second` have one direction"]);
    let mut c = ["0"; 21];
    (c[0], c[6], c[11], c[15], c[18], c[20]) = ("1", "1", "1", "1", "1", "-1");
    refused(&patch(own, &format!("anisotropic = [{}]", c.join(","))), &[definite, "-2.0"]);
}

/// Cylindrical axes about a node of the mesh: no direction there, and none is needed.
#[test]
fn axes_without_direction_at_a_node() {
    let text = text_of("anisotropic").replace("{ angle = \"35*pi/180\" }", "{ first = [\"x\", \"y\"] }");
    let run = solve_here(Scene::new(text), &[]).converged();
    assert!(near(run.number("pairs/0/force/0/1"), -10.0, 1e-9));
}

/// Nearly incompressible bodies under the wave of V2, whose closed form asks for E/(1 - nu^2) only: P2 does not lock, P1
/// does and says so.
#[test]
fn nearly_incompressible() {
    let (e, nu, k) = (2.1e5, 0.4999, std::f64::consts::PI);
    let x: f64 = k;
    let (sh, ch) = (x.sinh(), x.cosh());
    let a = sh * sh / (sh * ch + x) + (sh * ch + x) / (sh * sh - x * x);
    let exact = 1e-4 / (2.0 * (1.0 - nu * nu) / (e * k) * a + 1e-5);
    // the pressure's difference between crest and trough is twice the amplitude
    let error = |order: usize, n: usize| {
        let mut sets = vec![format!("mesh.set.n={n}")];
        for body in 0..2 {
            sets.extend([format!("body.{body}.poisson={nu}"), format!("body.{body}.order={order}")]);
        }
        let run = solve_set(case("wavy"), &sets).converged();
        let pressure = run.contact()["pressure"].to_vec();
        ((0.5 * (pressure[0] - pressure[pressure.len() - 1]) / exact - 1.0).abs(), run.warnings())
    };
    let (linear, said) = error(1, 16);
    let ((coarse, silent), (fine, _)) = (error(2, 16), error(2, 32));
    assert!(fine < 1e-3 && coarse > 3.5 * fine, "P2 {coarse:e}, {fine:e}");
    assert!(linear > 0.2, "P1 {linear:e}");
    assert!(said.contains("body lower: Poisson's ratio is 0.4999") && said.contains("order = 2"), "{said}");
    assert!(silent.is_empty(), "{silent}");
}

/// Strains of more than 3 per cent are reported, with the bodies and the place. Under q = 10 a block in plane strain, free sideways, has
/// strains -q (1 - nu^2)/E and q nu (1 + nu)/E.
#[test]
fn strains_that_are_not_small() {
    let run = |young: f64| {
        let young = format!("body.lower.young={young}");
        let sets = ["method={stop={residual=1e-10}}", &young, "body.upper.young=1e4"];
        solve_here(case("patch"), &sets).converged()
    };
    let soft = run(100.0);
    let warnings = soft.warnings();
    assert!(warnings.contains("strains of more than 3 per cent: `lower` up to 9.1e-02 at ("), "{warnings}");
    assert!(warnings.contains("in 100.0 per cent of the body") && !warnings.contains("`upper` up to"), "{warnings}");
    assert!((soft.number("bodies/0/max_strain") / 0.091 - 1.0).abs() < 1e-8, "{}", soft.said());
    assert!((soft.number("bodies/1/max_strain") / 9.1e-4 - 1.0).abs() < 1e-8, "{}", soft.said());
    assert!((0.0..1.0).contains(&soft.number("bodies/0/max_strain_at/1")), "{}", soft.said());
    // 9.1/E on both sides of 0.03
    let warns = |young| run(young).warnings().contains("strains of more");
    assert_eq!([warns(300.0), warns(310.0)], [true, false]);
}

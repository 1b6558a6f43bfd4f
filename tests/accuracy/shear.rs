//! Bonds that carry shear: laps by Volkersen's theory and by elements of glue, patches, and bodies that nothing else holds.

use crate::common::here::{solve_here, try_here};
use crate::common::{Report, Scene, case, solve, solve_on, text_of};
use serde_json::json;

fn near(value: f64, exact: f64, share: f64) -> bool {
    (value - exact).abs() <= share * exact.abs()
}

/// Return a scene of plates 30 long, each 1 thick and one above the other, with elements of about the size 1/n.
fn plates(count: usize, bodies: &[&str], contacts: &str) -> Scene {
    let script = format!(
        "DefineConstant[ n = {{2, Name \"n\"}} ]; DefineConstant[ h = {{1, Name \"h\"}} ];\nFor k In {{0:{}}}\n\
         p = newp; Point(p) = {{0,k,0}}; Point(p+1) = {{30,k,0}}; Point(p+2) = {{30,k+h,0}}; Point(p+3) = {{0,k+h,0}};\n\
         l = newl; Line(l) = {{p,p+1}}; Line(l+1) = {{p+1,p+2}}; Line(l+2) = {{p+2,p+3}}; Line(l+3) = {{p+3,p}};\n\
         Transfinite Curve {{l,l+2}} = 30*n+k+1; Transfinite Curve {{l+1,l+3}} = h*n+1;\n\
         s = news; Curve Loop(s) = {{l,l+1,l+2,l+3}}; Plane Surface(s) = {{s}}; Physical Surface(Sprintf(\"body%g\", k)) = {{s}};\n\
         Physical Curve(Sprintf(\"low%g\", k)) = {{l}}; Physical Curve(Sprintf(\"right%g\", k)) = {{l+1}};\n\
         Physical Curve(Sprintf(\"high%g\", k)) = {{l+2}}; Physical Curve(Sprintf(\"left%g\", k)) = {{l+3}};\nEndFor\n",
        count - 1
    );
    let body = |(k, keys): (usize, &&str)| {
        format!("[[body]]\nname = \"body{k}\"\nyoung = 2e5\npoisson = 0\norder = 2\n{keys}\n")
    };
    let bodies: String = bodies.iter().enumerate().map(body).collect();
    let scene = Scene::new(format!("dimension = 2\nmesh = {{ geo = \"plates.geo\" }}\n{bodies}{contacts}"));
    std::fs::write(scene.path.with_file_name("plates.geo"), script).expect("a script");
    scene
}

fn glue(low: usize, shear: &str) -> String {
    let high = low + 1;
    format!(
        "[[contact]]\nbetween = [\"high{low}\", \"low{high}\"]\nbond = true\nshear = {shear}\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n"
    )
}

/// Return the number of the pair that is the shear of the bond of two bodies.
fn shear_of(run: &Report, bodies: [&str; 2]) -> usize {
    let pairs = run["pairs"].as_array().expect("pairs");
    let of = |pair: &serde_json::Value| {
        bodies.iter().all(|body| pair["bodies"].to_string().contains(&format!("\"{body}\"")))
    };
    (0..pairs.len()).rfind(|&i| of(&pairs[i])).expect("a pair")
}

/// The overlap of a single lap whose plates do not bend, under F = 60 along it. Volkersen (1938): with w^2 = 2 K/(E t), the
/// traction at the distance x from the middle is F w/2 cosh(w x)/sinh(w L/2).
#[test]
fn a_single_lap() {
    let lower = "fix = [{ on = \"left0\", x = 0 }, { on = \"low0\", y = 0 }]";
    let upper = "fix = [{ on = \"high1\", y = 0 }]\nload = [{ on = \"right1\", force = [60, 0] }]";
    let scene = plates(2, &[lower, upper], &glue(0, "1e3"));
    let w = (2e3f64 / 2e5).sqrt();
    let check = |run: &Report, share: f64| {
        let shear = &run["pairs"][1];
        let along: Vec<f64> = (0..2).map(|side| shear["force"][side][0].as_f64().expect("a force")).collect();
        assert!(near(along[0], 60.0, 1e-6) && near(along[1], -60.0, 1e-6), "{along:?}");
        // the load is 1 above the middle of the lower plate: both pairs together carry its moment
        let number = |what: &str| shear[what].as_f64().unwrap_or_else(|| panic!("{what}"));
        let (peak, least) = (number("peak_pressure"), number("least_pressure"));
        assert!(
            near(peak, 30.0 * w / (15.0 * w).tanh(), share) && near(least, 30.0 * w / (15.0 * w).sinh(), share),
            "{peak} {least}"
        );
        assert!(near(number("peak_compression"), peak / 1e3, 1e-6) && shear["opening"] == json!([0.0, 0.0]), "{shear}");
        // tractions count whichever way they point, and on the whole length
        let (mean, length) = (number("mean_pressure"), number("contact_length"));
        assert!(
            near(mean, 2.0, 1e-6) && near(length, 30.0, 1e-9) && shear["closed"] == shear["points"],
            "{mean} {length}"
        );
        assert!(shear.get("peak_tension").is_none(), "{shear}");
    };
    let run = solve(&scene, &["--vtu", "--report"]).converged();
    check(&run, 0.01);
    let table = run.table("contact-body0-body1-shear.csv");
    for q in 0..table.rows() {
        let exact = 30.0 * w * (w * (table["x"][q] - 15.0)).cosh() / (15.0 * w).sinh();
        let (traction, slip) = (table["traction"][q].abs(), table["slip"][q].abs());
        assert!(
            near(traction, exact, 0.015) && near(traction, 1e3 * slip, 1e-9),
            "{}: {traction} {exact}",
            table["x"][q]
        );
    }
    for sets in [
        &["solver=mumps"][..],
        &["solver=hypre", "body.body0.order=1", "body.body1.order=3"],
        &["solver=condensed"],
        &["method.name='newton-robin'"],
        &["method.name='robin'", "method.gamma='aitken'"],
        &["contact.0.shear='1e3*(1 + 0*x)'", "mesh.set.n=1", "body.body0.order=4"],
    ] {
        check(&solve_here(&scene, sets).converged(), 0.02);
    }
    check(&solve_on(3, &scene, &["--set", "solver=hypre"]).converged(), 0.01);
    // a bond without shear leaves the upper plate free
    let free = plates(2, &[lower, upper], &glue(0, "1e3").replace("shear = 1e3\n", ""));
    assert_eq!(solve_here(&free, &[])["status"], "underconstrained");
}

/// A plate between two others, which glue alone holds: each film has the traction of a single lap of a plate of half the
/// thickness in the middle.
#[test]
fn a_double_lap() {
    let [lower, upper] = [(0, "low0"), (2, "high2")]
        .map(|(k, face)| format!("fix = [{{ on = \"left{k}\", x = 0 }}, {{ on = \"{face}\", y = 0 }}]"));
    let middle = "load = [{ on = \"right1\", force = [60, 0] }]";
    let scene = plates(3, &[&lower, middle, &upper], &(glue(0, "1e3") + &glue(1, "1e3")));
    let run = solve_here(&scene, &[]).converged();
    // tau'' = w^2 tau with w^2 = K (1/(E t) + 2/(E t)), where the strains of plates and middle differ by 30/(E t) at the
    // left end and by 60/(E t) at the right one
    let w = (3e3f64 / 2e5).sqrt();
    let at_end = w * (20.0 * (30.0 * w).cosh() + 10.0) / (30.0 * w).sinh();
    for bodies in [["body0", "body1"], ["body1", "body2"]] {
        let shear = &run["pairs"][shear_of(&run, bodies)];
        let force = shear["force"][0][0].as_f64().expect("a force").abs();
        let peak = shear["peak_pressure"].as_f64().expect("a traction");
        assert!(near(force, 30.0, 1e-3) && near(peak, at_end, 0.02), "{force} {peak} {at_end}");
    }
}

/// With K to infinity two plates are one.
#[test]
fn a_stiff_bond_is_one_body() {
    let fix = |k: usize| format!("fix = [{{ on = \"left{k}\", x = 0, y = 0 }}]");
    let (lower, upper) = (fix(0), fix(1) + "\nload = [{ on = \"high1\", traction = [0.1, -0.5] }]");
    let stiff = glue(0, "1e9").replace("1e5", "1e9");
    let two =
        solve_here(plates(2, &[&lower, &upper], &stiff), &["mesh.set.n=2", "method.stop.residual=1e-10"]).converged();
    let keys = "fix = [{ on = \"left0\", x = 0, y = 0 }]\nload = [{ on = \"high0\", traction = [0.1, -0.5] }]";
    let one = solve_here(plates(1, &[keys], ""), &["mesh.set.h=2"]).converged();
    assert!(near(two.number("F1"), one.number("F1"), 2e-3), "{} {}", two["F1"], one["F1"]);
}

/// A single lap that bends, with a film of 0.1: springs between plates that are drawn with the film's gap against elements
/// of glue in the gap. Their forces, energy and displacement differ by less than a per cent, since tractions turn
/// with the surfaces: without that they differ by five.
#[test]
fn a_lap_with_elements_of_glue() {
    const PLATES: &str =
        "SetFactory(\"OpenCASCADE\");\nRectangle(1) = {0, 0, 0, 100, 2}; Rectangle(2) = {75, 2.1, 0, 100, 2};\n";
    let ends = "left() = Curve In BoundingBox {-0.01,-0.01,-1, 0.01,2.01,1}; right() = Curve In BoundingBox {174.99,2.09,-1,175.01,4.11,1};\n\
        Physical Curve(\"left_end\") = {left()}; Physical Curve(\"right_end\") = {right()};\n";
    let glued = format!(
        "{PLATES}Rectangle(3) = {{75, 2, 0, 25, 0.1}}; BooleanFragments{{ Surface{{1}}; Delete; }}{{ Surface{{2,3}}; Delete; }}\n\
         MeshSize {{:}} = 0.7; MeshSize {{ PointsOf {{ Surface{{3}}; }} }} = 0.1; Physical Surface(\"all\") = {{1,2,3}}; Physical Surface(\"glue\") = {{3}};\n{ends}"
    );
    let bonded = format!(
        "{PLATES}MeshSize {{:}} = 0.7; Physical Surface(\"left\") = {{1}}; Physical Surface(\"right\") = {{2}};\n{ends}\
         Physical Curve(\"left_top\") = {{3}}; Physical Curve(\"right_bottom\") = {{5}};\n"
    );
    let (held, pulled) = (
        "fix = [{ on = \"left_end\", x = 0, y = 0 }]",
        "fix = [{ on = \"right_end\", y = 0 }]\nload = [{ on = \"right_end\", force = [100, 0] }]",
    );
    let body = |name: &str, keys: &str| {
        format!("[[body]]\nname = \"{name}\"\nyoung = 7e4\npoisson = 0.33\norder = 2\n{keys}\n")
    };
    let both = "fix = [{ on = \"left_end\", x = 0, y = 0 }, { on = \"right_end\", y = 0 }]\nload = [{ on = \"right_end\", force = [100, 0] }]\n\
        [[body.region]]\non = \"glue\"\nyoung = 1575\npoisson = 0.3125";
    let solved = |script: &str, bodies: &str| {
        let scene = Scene::new(format!("dimension = 2\nmesh = {{ geo = \"lap.geo\" }}\n{bodies}"));
        std::fs::write(scene.path.with_file_name("lap.geo"), script).expect("a script");
        solve_here(&scene, &["estimate=true"]).converged()
    };
    let elements = solved(&glued, &body("all", both));
    // G/h, and the modulus of a film that cannot contract over h
    let film = "[[contact]]\nbetween = [\"left_top\", \"right_bottom\"]\nbond = true\nshear = 6e3\nlayer = { linear = { stiffness = 2.2e4 } }\n";
    let springs = solved(&bonded, &(body("left", held) + &body("right", pulled) + film));
    let share = |one: &str, other: &str| springs.number(one) / elements.number(other) - 1.0;
    for (one, other) in [
        ("F1", "F1"),
        ("bodies/1/max_displacement", "bodies/0/max_displacement"),
        ("bodies/0/balance/supports/0/force/1", "bodies/0/balance/supports/0/force/1"),
    ] {
        assert!(share(one, other).abs() < 0.01, "{one}: {} {}", springs.number(one), elements.number(other));
    }
    let moments: Vec<f64> =
        (0..2).map(|side| (0..2).map(|i| springs.number(&format!("pairs/{i}/moment/{side}/2"))).sum()).collect();
    assert!((moments[0] + moments[1]).abs() < 1e-6 * moments[0].abs(), "{moments:?}");
    assert!(springs.number("discretization_error/pressure/1") < 0.1, "{}", springs["discretization_error"]);
}

/// A block on a block under a constant shear: traction and slip are constant to rounding where meshes do not match, in the
/// plane; blocks that are nearly rigid slip alike in space and around an axis.
#[test]
fn patches() {
    let sides = "{ on = \"LEFT\", traction = [0, -10] }, { on = \"RIGHT\", traction = [0, 10] }";
    let of = |k: usize| sides.replace("LEFT", &format!("left{k}")).replace("RIGHT", &format!("right{k}"));
    let lower = format!("fix = [{{ on = \"low0\", x = 0, y = 0 }}]\nload = [{}]", of(0));
    let upper = format!("load = [{}, {{ on = \"high1\", traction = [10, 0] }}]", of(1));
    let run = solve_here(plates(2, &[&lower, &upper], &glue(0, "2e4")), &["mesh.set.n=1"]).converged();
    let table = run.contact_of(1);
    for q in 0..table.rows() {
        assert!(near(table["traction"][q].abs(), 10.0, 1e-8) && near(table["slip"][q].abs(), 5e-4, 1e-8));
    }
    for (name, key, area) in [("patch-3d", "[8, 6, 0]", 1.0), ("patch", "[8, 0]", 1.0)] {
        let text = text_of(name)
            .replace("[[contact]]\n", "[[contact]]\nbond = true\nshear = 2e4\n")
            .replace("load = [", &format!("force = {key}\nload = ["));
        let drop = |line: &&str| !line.contains("upper_pin") && !line.contains("upper_spin");
        let text: String = text.lines().filter(drop).flat_map(|line| [line, "\n"]).collect();
        let run =
            solve_here(Scene::new(text), &["body.lower.young=1e10", "body.upper.young=1e10", "method={}"]).converged();
        let exact = key.matches("6").count() as f64 * 36.0 + 64.0;
        let sum: f64 = (1..run["pairs"].as_array().expect("pairs").len())
            .map(|i| (0..3).map(|c| run.forces(i)[0][c].powi(2)).sum::<f64>())
            .sum();
        assert!(near(sum, exact * area, 1e-6), "{name}: {sum} {exact}");
        for q in 0..run.contact_of(1).rows() {
            let slip: f64 =
                (1..run["pairs"].as_array().expect("pairs").len()).map(|i| run.contact_of(i)["slip"][q].powi(2)).sum();
            assert!(near(slip.sqrt(), exact.sqrt() / 2e4, 1e-4), "{name}: {slip}");
        }
    }
}

#[test]
fn shear_that_cannot_be() {
    for (sets, words) in [
        (&["contact.0.shear=1e3"][..], "`shear` of a layer that is no bond"),
        (&["contact.0.shear=-1e3", "contact.0.bond=true"], "the stiffness is -1000"),
        (&["contact.0.shear='x - 100'", "contact.0.bond=true"], "must be greater than 0"),
        (
            &["contact.0={between='auto',distance=0.1,bond=true,shear=1,layer={linear={stiffness=1}}}"],
            "`shear` for pairs that are found",
        ),
        (
            &["contact.0={on='lower_top',obstacle=true,bond=true,shear=1,layer={linear={stiffness=1}}}"],
            "`shear` of an obstacle",
        ),
        (&["contact.0.layer={linear={stiffness=1},shear=1}"], "shear = K stands beside bond = true"),
    ] {
        let error = try_here(case("patch"), sets).err().expect(words).render(false);
        assert!(error.contains(words), "{error}");
    }
}

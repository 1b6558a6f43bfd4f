//! Bodies on coarse meshes in any units of length and stress.

use super::here::solve_here;
use super::{Scene, root};
use std::fs;
use std::process::Command;

/// Two bodies of the cases with everything but the layer: in the plane, in space, and of revolution.
pub struct Shape {
    head: &'static str,
    /// The script of its mesh among the cases.
    pub script: &'static str,
    numbers: [&'static str; 2],
    /// Supports of both bodies.
    fix: [&'static str; 2],
    /// Whether a groove is between them; else the gap is that of the mesh.
    has_groove: bool,
}

/// One of each kind, on coarse meshes.
pub const SHAPES: [Shape; 3] = [
    Shape {
        head: "dimension = 2",
        script: "groove/groove.geo",
        numbers: ["n", "4"],
        fix: ["{ on = \"lower_axis\", x = 0 }, { on = \"lower_face\", y = 0 }", "{ on = \"upper_axis\", x = 0 }"],
        has_groove: true,
    },
    Shape {
        head: "dimension = 3",
        script: "groove3d/groove3d.geo",
        numbers: ["n", "2"],
        fix: [
            "{ on = \"lower_axis\", x = 0 }, { on = \"lower_face\", y = 0 }, { on = \"lower_sides\", z = 0 }",
            "{ on = \"upper_axis\", x = 0 }, { on = \"upper_sides\", z = 0 }",
        ],
        has_groove: true,
    },
    Shape {
        head: "dimension = 2\nplane = \"axisymmetric\"",
        script: "hertz-sphere/meridian.geo",
        numbers: ["n", "2"],
        fix: ["{ on = \"lower_face\", y = 0 }", ""],
        has_groove: false,
    },
];

impl Shape {
    /// Its mesh by Gmsh, with all lengths times `length`.
    fn mesh(&self, length: f64) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("shape.msh");
        let mut gmsh = Command::new("gmsh");
        gmsh.arg(root().join("meshes").join(self.script)).args(["-3", "-v", "1", "-format", "msh41"]);
        gmsh.arg("-setnumber").args(self.numbers).arg("-o").arg(&file);
        assert!(gmsh.status().expect("gmsh").success());
        let mut in_nodes = false;
        let scaled = |line: &str| {
            in_nodes = if line.starts_with('$') { line == "$Nodes" } else { in_nodes };
            let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            match numbers[..] {
                [x, y, z] if in_nodes => format!("{:e} {:e} {:e}\n", length * x, length * y, length * z),
                _ => format!("{line}\n"),
            }
        };
        fs::read_to_string(file).expect("a mesh").lines().map(scaled).collect()
    }

    /// The scene with stresses times `stress` and lengths times `length`; the layer has these units already.
    pub fn scene(&self, stress: f64, length: f64, layer: &str) -> Scene {
        let (head, [lower, upper], young, pressure) = (self.head, self.fix, 2.1e5 * stress, 10.0 * stress);
        let gap = if self.has_groove {
            format!("{:e} * max(0, 1 - (x/{length:e} - 4)^2)^1.5", 5e-4 * length)
        } else {
            "0".to_owned()
        };
        let scene = Scene::new(format!(
            r#"{head}
mesh = "shape.msh"
body = [
    {{ name = "lower", young = {young:e}, poisson = 0.3, fix = [{lower}] }},
    {{ name = "upper", young = {young:e}, poisson = 0.3, fix = [{upper}], load = [{{ on = "upper_face", pressure = {pressure:e} }}] }},
]
contact = [{{ between = ["lower_top", "upper_bottom"], gap = "{gap}", layer = {{ {layer} }} }}]
"#
        ));
        fs::write(scene.path.with_file_name("shape.msh"), self.mesh(length)).expect("a mesh");
        scene
    }

    /// Pressures in units of `stress` with the layer (c/B)^2, which a stress of 10 closes by 8e-5 in the first units.
    pub fn pressures(&self, stress: f64, length: f64, set: &str) -> Vec<f64> {
        let layer = format!("power = {{ B = {:e}, a = 0.5 }}", 2.5e-5 * length / stress.sqrt());
        let run = solve_here(self.scene(stress, length, &layer), &[set]).converged();
        run.contact()["pressure"].iter().map(|pressure| pressure / stress).collect()
    }
}

//! Every scene of `meshes` on a coarse mesh.

use super::judge::Case;

/// The cases of docs/verification.md, with the numbers that make their meshes coarse.
pub const CASES: [Case; 38] = [
    case("anisotropic/scene.toml", &[]),
    case("anisotropic-3d/scene.toml", &[]),
    case("bearing/scene.toml", &["mesh.set.n=2", "mesh.set.rollers=5"]),
    case("blocks/scene.toml", &["mesh.set.k=2"]),
    case("coating/scene.toml", &["mesh.set.n=6"]),
    case("flange/scene.toml", &["mesh.set.n=1", "body.0.order=1", "body.1.order=1"]),
    case("groove/scene.toml", &["mesh.set.n=8"]),
    case("groove-held/scene.toml", &["mesh.set.n=8"]),
    case("groove-held/scene.toml", &["mesh.set.n=8", "body.0.order=2", "body.1.order=2", "method={}"]),
    case("groove-held/graded.toml", &["mesh.set.n=0.75"]),
    case("groove-held/history.toml", &["mesh.set.n=6"]),
    case("groove3d/scene.toml", &["mesh.set.n=3"]),
    case("groove3d/graded.toml", &["mesh.set.n=0.5", "body.0.order=1", "body.1.order=1"]),
    case("half-planes/scene.toml", &["mesh.set.n=8", "method={}"]),
    case("hertz-line/scene.toml", &["mesh.set.n=2"]),
    case("hertz-sphere/scene.toml", &["mesh.set.n=1", "mesh.set.edge=1"]),
    case("hertz-sphere/axisymmetric.toml", &["mesh.set.n=2", "mesh.set.edge=1"]),
    case("manufactured/scene.toml", &["mesh.set.n=4"]),
    case("manufactured/scene.toml", &["mesh.set.n=3", "body.0.order=2", "body.1.order=2"]),
    case("manufactured-3d/scene.toml", &["mesh.set.n=3"]),
    case("paraboloid/scene.toml", &["mesh.set.h=0.1", "body.0.order=1", "body.1.order=1"]),
    case("patch/scene.toml", &["mesh.set.nl=3"]),
    case("patch/axisymmetric.toml", &["mesh.set.nl=3"]),
    case("patch-2d/scene.toml", &["mesh.set.nl=3"]),
    case("patch-3d/scene.toml", &[]),
    case("patch-3d/scene.toml", &["body.0.order=2", "body.1.order=2"]),
    case("ring/scene.toml", &["mesh.set.n=2"]),
    case("ring/symmetric.toml", &["mesh.set.n=2"]),
    case("rings/scene.toml", &["mesh.set.ni=3", "mesh.set.no=4"]),
    case("rough/scene.toml", &["mesh.set.n=4"]),
    case("shells/axisymmetric.toml", &["mesh.set.ni=3", "mesh.set.no=4"]),
    case("shells/scene.toml", &["mesh.set.hi=0.5", "mesh.set.ho=0.4", "body.0.order=1", "body.1.order=1"]),
    case("sphere-layer/axisymmetric.toml", &["mesh.set.n=2", "mesh.set.edge=1"]),
    case("sphere-layer/scene.toml", &["mesh.set.n=2"]),
    case("stack/scene.toml", &["mesh.set.n1=4", "mesh.set.n2=5", "mesh.set.n3=6"]),
    case("wall/scene.toml", &["mesh.set.columns=3", "mesh.set.rows=3"]),
    case("wavy/scene.toml", &["mesh.set.n=6"]),
    case("westergaard/scene.toml", &["mesh.set.n=3"]),
];

const fn case(scene: &'static str, set: &'static [&'static str]) -> Case {
    Case { scene, set }
}

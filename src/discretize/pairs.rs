//! Contacts of the scene on the mesh: which body each surface bounds, which side carries the points.

use super::find::{find_group, placed, point};
use super::part::Part;
use crate::contact::pieces::{Reach, Shared};
use crate::contact::{self, ContactPair, Fault, Fine, Side};
use crate::error::{Error, Located, Result};
use crate::fem::Facets;
use crate::mesh::{Group, Mesh};
use crate::scene::ContactSpec;

/// The pair of a contact, its integration points if `fine` asks for them, and whether its side a is the scene's second
/// surface.
pub fn make_pair<const D: usize>(
    spec: &ContactSpec,
    mesh: &Mesh<D>,
    cut: contact::pieces::Cut<D>,
    parts: &[Part<D>],
    fine: bool,
) -> Result<(ContactPair, Option<Fine<D>>, bool)> {
    let mut sides = Vec::new();
    for name in &spec.between {
        let group = find_group(mesh, name, &[D - 1], "contact surface")?;
        let (body, facets) = owner_of(name, group, parts)?;
        let part = &parts[body];
        sides.push((body, Side::new(&name.value, &part.space, facets, &part.held.prescribed, &part.held.frame)));
    }
    let (body_b, b) = sides.remove(1);
    let (body_a, a) = sides.remove(0);
    if body_a == body_b {
        return Err(Error::scene(
            &spec.between[1].place,
            format!("both surfaces belong to body `{}`", parts[body_a].spec.name.value),
        )
        .help("contact of a body with itself is out of scope; make two bodies of it"));
    }
    // the finer side carries the points, whatever the order in the scene
    let (fine_a, fine_b) = (a.mean_measure(), b.mean_measure());
    let a_carries = if (fine_a - fine_b).abs() > 1e-6 * fine_a { fine_a < fine_b } else { a.name < b.name };
    let (a, b, bodies) = if a_carries { (a, b, [body_a, body_b]) } else { (b, a, [body_b, body_a]) };
    let shared = cut(&a, &b, &Reach::between(&a, &b));
    let pair = pair_on(spec, &shared, &a, &b, bodies)?;
    let fine = fine.then(|| Fine::new(&a, &b, &shared, &pair, &|x| spec.gap.eval(x)));
    Ok((pair, fine, !a_carries))
}

fn pair_on<const D: usize>(
    spec: &ContactSpec,
    shared: &[Shared<D>],
    a: &Side<D>,
    b: &Side<D>,
    bodies: [usize; 2],
) -> Result<ContactPair> {
    contact::assemble(a, b, bodies, shared, &|x| spec.gap.eval(x), &spec.layer).map_err(|fault| match fault {
        Fault::Law(error) => error,
        Fault::NoPartner => {
            let names = [&spec.between[0].value, &spec.between[1].value];
            Error::scene(
                &spec.between[0].place,
                format!("`{}` and `{}` do not face each other anywhere", names[0], names[1]),
            )
            .help("a pair needs surfaces whose outer normals point at each other; look at the mesh with `gmsh`")
        }
        Fault::Gap(x) => placed(&spec.gap, format!("the gap is not finite at {}", point(x))),
    })
}

/// The body that a contact surface bounds, with the facets.
fn owner_of<const D: usize>(name: &Located<String>, group: &Group, parts: &[Part<D>]) -> Result<(usize, Facets<D>)> {
    let mut found: Vec<(usize, Facets<D>)> = parts
        .iter()
        .enumerate()
        .map(|(body, part)| (body, part.space.facets(group)))
        .filter(|(_, facets)| facets.count() > 0)
        .collect();
    let all = group.connectivity.len() / group.stride;
    match (found.pop(), found.len()) {
        (Some((body, facets)), 0) if facets.count() == all => Ok((body, facets)),
        (Some((body, facets)), 0) => {
            let body = &parts[body].spec.name.value;
            let message = format!("only {} of {all} facets of `{}` bound body `{body}`", facets.count(), name.value);
            Err(Error::scene(&name.place, message)
                .help("a contact surface must lie on one body as a whole: split the physical group"))
        }
        (None, _) => Err(Error::scene(&name.place, format!("surface `{}` bounds no body of the scene", name.value))
            .help("add the body it belongs to, or name another surface")),
        (Some((last, _)), _) => {
            let bodies = [found[0].0, last].map(|body| parts[body].spec.name.value.clone());
            let message = format!("surface `{}` bounds both `{}` and `{}`", name.value, bodies[0], bodies[1]);
            Err(Error::scene(&name.place, message)
                .help("the bodies share mesh nodes there: give each its own curve or surface in the geometry"))
        }
    }
}

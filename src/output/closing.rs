//! The closing lines of a run for the terminal: counts, errors, pairs, bodies, balances and warnings of a report.

use super::report::{
    BalanceReport, BodyReport, ForceReport, IntervalReport, LISTED, ObstacleReport, PairReport, PairResult, Report,
    RoundReport, SealReport, StepReport, TensionReport, UnmetReport, busiest,
};
use super::{RunStatus, sci, seconds};
use std::collections::BTreeSet;

/// Return the orders of the elements of bodies in words, such as `2` or `1 and 2`.
pub fn orders(bodies: &[BodyReport]) -> String {
    let orders: BTreeSet<usize> = bodies.iter().map(|body| body.order).collect();
    orders.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ")
}

/// Format a number with `digits` after the point, or with an exponent if it is too small or too large for that.
pub fn readable(value: f64, digits: usize) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e6).contains(&size) { format!("{value:.digits$}") } else { sci(value, digits) }
}

/// Units behind the numbers of the closing lines, each with a blank before it; empty where the scene names none.
#[derive(Debug, Clone, Default)]
pub struct UnitWords {
    /// Unit of coordinates and displacements.
    pub length: String,
    /// Unit of the contact: that of a length in the plane, of an area in space and for bodies of revolution.
    pub extent: String,
    /// Unit of stresses and pressures.
    pub stress: String,
    /// Unit of forces.
    pub force: String,
    /// Whether vectors have two components: in the plane and of revolution.
    pub is_plane: bool,
}

impl UnitWords {
    /// Return the components of a vector of the scene.
    fn components<'v>(&self, v: &'v [f64; 3]) -> &'v [f64] {
        &v[..if self.is_plane { 2 } else { 3 }]
    }

    fn point(&self, x: [f64; 3]) -> String {
        vector(self.components(&x), 0.0, 4)
    }

    /// Return a force among forces of the size `scale`.
    fn vector(&self, v: [f64; 3], scale: f64) -> String {
        vector(self.components(&v), scale, 6)
    }
}

impl UnmetReport {
    /// Return the error in words.
    pub fn in_words(&self) -> String {
        let [a, b] = &self.surfaces;
        format!(
            "{} of the {} between `{a}` and `{b}`, most of it near {}",
            sci(self.error, 1),
            self.of,
            place(self.place)
        )
    }
}

impl RoundReport {
    /// Heads of the columns of [`Self::line`].
    pub const HEADS: &str =
        "  mesh      cells       dofs   pressure  displacement      force     energy  iterations   seconds";

    /// Return the mesh with this number, its estimated errors and its cost as a line for the terminal.
    pub fn line(&self, number: usize) -> String {
        let errors = [self.pressure, self.displacement, self.force, self.energy];
        // a force that equilibrium alone determines has no error but roundoff
        let in_words = |error: f64| if error < f64::EPSILON { "0".to_owned() } else { sci(error, 2) };
        let [pressure, displacement, force, energy] = errors.map(in_words);
        format!(
            "  {number:>4} {:>10} {:>10} {pressure:>10} {displacement:>13} {force:>10} {energy:>10} {:>11} {:>9}",
            self.cells,
            self.dofs,
            self.iterations,
            seconds(self.seconds)
        )
    }
}

impl Report {
    /// Return the closing lines of a run for the terminal. The table of adapted meshes is not among them: each mesh has
    /// its line when it ends.
    pub fn summary(&self, units: &UnitWords) -> String {
        let mut lines = vec![format!("{}: {}", self.title, self.message), self.counts()];
        lines.extend(self.discretization_line());
        lines.extend(self.interval_line());
        if self.steps.len() <= LISTED {
            lines.extend(self.steps.iter().enumerate().map(|(index, step)| self.step_line(index + 1, step, units)));
        }
        lines.extend(self.left_out.iter().map(|left_out| format!("  {left_out}")));
        let listed = busiest(self.results(), LISTED).into_iter().map(|i| &self.pairs[i]);
        // where loads push bodies without end, or against nothing, there is no state of them to tell
        if !self.has_no_state() {
            lines.extend(listed.map(|pair| pair_line(pair, self.is_bonded(pair), units)));
            lines.extend(self.balance_lines(units));
        }
        lines.extend(warning_lines(&self.warnings, "report.json"));
        lines.join("\n")
    }

    fn is_bonded(&self, pair: &PairReport) -> bool {
        self.settings["contact"][pair.contact]["bond"] == true
    }

    /// Return whether the run ended since the loads have no equilibrium.
    pub fn has_no_state(&self) -> bool {
        // of a history the state is that of its last step
        let status = self.steps.last().map_or(self.status, |step| step.status);
        matches!(status, RunStatus::Underconstrained | RunStatus::Unbounded)
    }

    /// Return the line with the counters, errors and times.
    pub fn counts(&self) -> String {
        let error = match (self.error_bound, self.error_estimate) {
            (Some(error), _) => format!(", error at most {}", sci(error, 2)),
            (None, Some(error)) => format!(", estimated error {}", sci(error, 2)),
            (None, None) => String::new(),
        };
        format!(
            "  {}: {}, {}, {}, residual {}{error}, {} dofs of order {}, {} s",
            self.method,
            counted(self.iterations, "iteration"),
            counted(self.sweeps, "sweep"),
            counted(self.factorizations, "factorization"),
            sci(self.residual.unwrap_or(f64::NAN), 2),
            self.dofs,
            orders(&self.bodies),
            seconds(self.times.get("total").copied().unwrap_or(f64::NAN)),
        )
    }

    /// Return the line on the estimated error of the discretisation, the largest of the pairs.
    pub fn discretization_line(&self) -> Option<String> {
        let error = self.discretization_error.as_ref()?;
        let largest = |errors: &[f64]| sci(errors.iter().copied().fold(f64::NAN, f64::max), 1);
        Some(format!(
            "  estimated discretisation error: pressure {}, displacement {}, force {}, energy norm {}",
            largest(&error.pressure),
            sci(error.displacement, 1),
            largest(&error.force),
            sci(error.energy, 1)
        ))
    }

    /// Return the line on the interval of gamma, if it was asked for.
    fn interval_line(&self) -> Option<String> {
        let words = match &self.gamma_interval {
            Some(IntervalReport { theorem, descent, .. }) => format!(
                "F1 falls in every step below {}, theorem 3 promises convergence {}, with the last form G in all steps",
                sci(*descent, 2),
                theorem.map_or("nowhere".to_owned(), |end| format!("below {}", sci(end, 2)))
            ),
            None if self.status.is_solved() => {
                "unknown, as no step was made or the eigenvalues did not settle".to_owned()
            }
            None => "unknown, as its bounds are those at a solution, and the run found none".to_owned(),
        };
        (self.settings["method"]["interval"] == true).then(|| format!("  interval of gamma: {words}"))
    }

    /// Return the line of a load step; `number` counts from 1.
    fn step_line(&self, number: usize, step: &StepReport, units: &UnitWords) -> String {
        let UnitWords { stress, force, .. } = units;
        let pairs = match step.pairs.len() {
            _ if self.has_no_state() && number == self.steps.len() => "no equilibrium".to_owned(),
            ..=LISTED => {
                let pairs = step.pairs.iter().zip(&self.pairs).map(|(at, pair)| {
                    let ([a, b], on) = (&pair.surfaces, &pair.bodies[0]);
                    let (peak, sum) = (peaks(at, false, units), units.vector(at.force[0], 0.0));
                    let closed = if self.is_bonded(pair) { "compressed" } else { "closed" };
                    format!("{a} - {b}: force on `{on}` {sum}{force}, {peak}, {} points {closed}", at.closed)
                });
                pairs.collect::<Vec<_>>().join("; ")
            }
            count => {
                let peak = step.pairs.iter().map(|pair| pair.peak_pressure).fold(0.0, f64::max);
                let closed: usize = step.pairs.iter().map(|pair| pair.closed).sum();
                format!("{count} pairs, peak pressure {}{stress}, {closed} points closed", readable(peak, 6))
            }
        };
        let factors = step.factors.iter().map(|(name, factor)| format!("{name} {}", readable(*factor, 4)));
        let factors = factors.collect::<Vec<_>>().join(", ");
        format!("  step {number}, {factors}: {}, {}: {pairs}", counted(step.iterations, "iteration"), step.status)
    }

    /// Return the words on the largest displacement and von Mises stress of all bodies, empty where none is known.
    fn largest_fields(&self, units: &UnitWords) -> String {
        let most = |field: fn(&BodyReport) -> Option<f64>| self.bodies.iter().filter_map(field).reduce(f64::max);
        largest(most(|body| body.max_displacement), most(|body| body.max_von_mises), "", units)
    }

    /// Return a line per body on its extreme fields and its balance, or one line for many bodies; none before the first
    /// iterate.
    fn balance_lines(&self, units: &UnitWords) -> Vec<String> {
        if self.residual.is_none() {
            return Vec::new();
        }
        if self.bodies.len() <= LISTED {
            return self.bodies.iter().map(|body| balance_line(body, units)).collect();
        }
        let worst = |imbalance: fn(&BalanceReport) -> f64| {
            let all = self.bodies.iter().map(|body| (imbalance(&body.balance), &body.name));
            all.max_by(|a, b| a.0.total_cmp(&b.0))
                .map_or(String::new(), |(most, name)| format!("{} (`{name}`)", sci(most, 1)))
        };
        vec![format!(
            "  {} bodies: {}imbalance at most {} of forces, {} of moments",
            self.bodies.len(),
            self.largest_fields(units),
            worst(|balance| balance.force_imbalance),
            worst(|balance| balance.moment_imbalance)
        )]
    }
}

/// Return the words on the largest displacement and von Mises stress, followed by a semicolon; empty where a field is
/// not known.
fn largest(displacement: Option<f64>, von_mises: Option<f64>, place: &str, units: &UnitWords) -> String {
    let (Some(displacement), Some(von_mises)) = (displacement, von_mises) else { return String::new() };
    if displacement == 0.0 && von_mises == 0.0 {
        return "at rest; ".to_owned();
    }
    let UnitWords { length, stress, .. } = units;
    let (displacement, von_mises) = (sci(displacement, 3), readable(von_mises, 6));
    format!("displacement up to {displacement}{length}, von Mises stress up to {von_mises}{stress}{place}; ")
}

/// Return the line of a pair, which its surfaces name in the order of the scene.
fn pair_line(pair: &PairReport, is_bonded: bool, units: &UnitWords) -> String {
    let (PairReport { surfaces: [a, b], bodies: [on, _], result, estimate, .. }, extent) = (pair, pair.result.extent);
    if result.shear {
        let sum = units.vector(result.force[0], result.peak_pressure * extent.contact());
        let (traction, slip) = (readable(result.peak_pressure, 6), sci(result.peak_compression, 3));
        let UnitWords { stress, force, length, .. } = units;
        return format!(
            "  {a} - {b}: shear force on `{on}` {sum}{force}, traction up to {traction}{stress}, slip up to {slip}{length}"
        );
    }
    let is_pulled = result.tension.is_some_and(|tension| tension.peak_tension > 0.0);
    if result.peak_pressure <= 0.0 && !is_pulled || result.peak_pressure.is_nan() {
        return format!("  {a} - {b}: no contact");
    }
    let UnitWords { extent: size, force, length, .. } = units;
    let moved = |ObstacleReport { approach, tilt, moment, .. }: &ObstacleReport| {
        let turned = || format!(", tilt {}, moment {}", vector(tilt, 0.0, 6), vector(moment, 0.0, 6));
        let turned = if *tilt == [0.0; 3] { String::new() } else { turned() };
        format!(", approach {}{length}{turned}", sci(*approach, 5))
    };
    let offset = result.offset.map(|offset| format!(", offset {}{length}", sci(offset, 5)));
    let more = result.obstacle.as_ref().map(moved).or(offset).unwrap_or_default();
    let what = if extent.is_area() { "area" } else { "length" };
    let [closed, open] = if is_bonded { ["compressed", "pulled"] } else { ["in contact", "open"] };
    let peak = result.peak_pressure.max(result.tension.map_or(0.0, |tension| tension.peak_tension));
    let scale = peak * (extent.contact() + extent.open());
    let error = estimate.map(|errors| format!(", estimated error of pressures {}", sci(errors.pressure_estimate, 1)));
    let sealing = |SealReport { sealing_pressure, sealing_at }: SealReport| {
        format!(", sealing pressure {}{} at {}", readable(sealing_pressure, 6), units.stress, units.point(sealing_at))
    };
    format!(
        "  {a} - {b}: force on `{on}` {}{force}, normal force {}{force}{more}, {}{}, {what} {closed} {}{size}, {open} {}{size}{}",
        units.vector(result.force[0], scale),
        readable(result.normal_force, 6),
        peaks(result, true, units),
        result.seal.map_or(String::new(), sealing),
        readable(extent.contact(), 6),
        readable(extent.open(), 6),
        error.unwrap_or_default()
    )
}

/// Return the words on the largest pressure, with its place and other pressures if `is_whole`, and on the largest
/// tension of a bond. A bond that only pulls has no pressure.
fn peaks(result: &PairResult, is_whole: bool, units: &UnitWords) -> String {
    let stress = &units.stress;
    let tension = result.tension.filter(|tension| tension.peak_tension > 0.0);
    let mut words = Vec::new();
    if result.peak_pressure > 0.0 || tension.is_none() {
        let [least, mean] = [result.least_pressure, result.mean_pressure].map(|pressure| readable(pressure, 6));
        let others = format!(" at {}, mean {mean}{stress}, least {least}{stress}", units.point(result.peak_at));
        let others = if is_whole { others } else { String::new() };
        words.push(format!("peak pressure {}{stress}{others}", readable(result.peak_pressure, 6)));
    }
    words.extend(tension.map(|TensionReport { peak_tension, peak_tension_at, .. }| {
        format!("largest tension {}{stress} at {}", readable(peak_tension, 6), units.point(peak_tension_at))
    }));
    words.join(", ")
}

/// Change of the stress within the cells at its largest value beyond which this value may be anything: half of it.
/// There the next mesh of half the size has half of the change where the stress is smooth, and the same where it is
/// singular.
pub const UNSETTLED: f64 = 0.5;

/// Return the line of a body with its reactions and imbalances.
fn balance_line(body: &BodyReport, units: &UnitWords) -> String {
    let BalanceReport { loads, contacts, supports, springs, rigid, force_imbalance, moment_imbalance, .. } =
        &body.balance;
    let all = [loads, contacts].into_iter().chain(supports).chain(springs).chain(rigid);
    let scale = all.flat_map(|part| part.force).fold(0.0, |most: f64, f| most.max(f.abs()));
    let named = |verb: &str, parts: &mut dyn Iterator<Item = &ForceReport>| {
        let all: Vec<_> = parts.map(|part| format!("{} {}", part.on, units.vector(part.force, scale))).collect();
        if all.is_empty() { String::new() } else { format!("{verb} {}{}; ", all.join(", "), units.force) }
    };
    let reactions = named("held by", &mut supports.iter().chain(springs)) + &named("rigid", &mut rigid.iter());
    let change = body.max_von_mises_change.filter(|change| *change > UNSETTLED);
    let doubt = change.map_or(String::new(), |change| {
        format!(", not to be trusted: it changes by {:.0} % within a cell there", 100.0 * change)
    });
    let place = body.max_von_mises_at.map_or(String::new(), |x| format!(" at {}{doubt}", units.point(x)));
    let fields = largest(body.max_displacement, body.max_von_mises, &place, units);
    format!(
        "  {}: {fields}{reactions}imbalance {} of forces, {} of moments",
        body.name,
        sci(*force_imbalance, 1),
        sci(*moment_imbalance, 1)
    )
}

/// Return a line for each of the first [`LISTED`] warnings, and one that names the file `others` with the rest.
pub fn warning_lines(warnings: &[String], others: &str) -> Vec<String> {
    let mut lines: Vec<String> = warnings.iter().take(LISTED).map(|warning| format!("  warning: {warning}")).collect();
    if warnings.len() > LISTED {
        lines.push(format!("  and {} more warnings: {others} has all", warnings.len() - LISTED));
    }
    lines
}

/// Return a number with its noun, `1 sweep` or `2 sweeps`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Relative error of forces that no run promises to undercut: the tolerance of a run that gives none. A smaller
/// component beside a larger one is the roundoff of a sum over nodes, and is printed as zero. Files have all digits.
pub const DIGITS: f64 = 1e-8;

/// Return a point of the scene for a message.
pub fn place(x: [f64; 3]) -> String {
    vector(&x, 0.0, 4)
}

/// Return a vector with this number of digits, whose roundoff is that of numbers of the size `scale`.
fn vector(v: &[f64], scale: f64, digits: usize) -> String {
    let largest = v.iter().fold(scale, |most: f64, v| most.max(v.abs()));
    let shown = |v: &f64| readable(if v.abs() < DIGITS * largest { 0.0 } else { *v }, digits);
    format!("({})", v.iter().map(shown).collect::<Vec<_>>().join(", "))
}

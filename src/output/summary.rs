//! The closing lines of a run on the terminal.

use super::format::{sci, seconds};
use super::report::{BalanceReport, BodyReport, ForceReport, LISTED, PairReport, Report, busiest, readable};
use super::steps::StepReport;

impl Report {
    /// Return the closing lines of a run for the terminal.
    pub fn summary(&self) -> String {
        let mut lines = vec![format!("{}: {}", self.title, self.message), self.counts()];
        lines.extend(self.settings["units"].as_str().map(|units| format!("  units: {units}")));
        lines.extend(self.mesh_table());
        lines.extend(self.discretization_line());
        if self.steps.len() <= LISTED {
            lines.extend(self.steps.iter().enumerate().map(|(index, step)| step_line(index + 1, step)));
        }
        lines.extend(self.left_out.iter().map(|left_out| format!("  {left_out}")));
        lines.extend(busiest(&self.pairs, LISTED).into_iter().map(|i| self.pair_line(&self.pairs[i])));
        lines.extend(self.balance_lines());
        lines.extend(warning_lines(&self.warnings, "report.json"));
        lines.join("\n")
    }

    /// Return the line with the counters, errors and times.
    fn counts(&self) -> String {
        let number = |value: Option<f64>| sci(value.unwrap_or(f64::NAN), 2);
        format!(
            "  {}: {} iterations, {} sweeps, {} factorizations, residual {}, {} {}, {} dofs, {} s",
            self.method,
            self.iterations,
            self.sweeps,
            self.factorizations,
            number(self.residual),
            if self.error_bound.is_some() { "error at most" } else { "estimated error" },
            number(self.error_bound.or(self.error_estimate)),
            self.dofs,
            seconds(self.times.get("total").copied().unwrap_or(f64::NAN)),
        )
    }

    /// Return the table of the adapted meshes, empty without any.
    fn mesh_table(&self) -> Vec<String> {
        if self.rounds.is_empty() {
            return Vec::new();
        }
        let mut lines =
            vec!["  mesh      cells       dofs   pressure  displacement     energy  iterations   seconds".to_owned()];
        for (index, round) in self.rounds.iter().enumerate() {
            let [pressure, displacement, energy] =
                [round.pressure, round.displacement, round.energy].map(|e| sci(e, 2));
            lines.push(format!(
                "  {index:>4} {:>10} {:>10} {pressure:>10} {displacement:>13} {energy:>10} {:>11} {:>9}",
                round.cells,
                round.dofs,
                round.iterations,
                seconds(round.seconds)
            ));
        }
        lines
    }

    /// Return the line on the estimated error of the discretisation.
    fn discretization_line(&self) -> Option<String> {
        let error = self.discretization_error.as_ref()?;
        let pressures: Vec<String> = error.pressure.iter().map(|&error| sci(error, 1)).collect();
        Some(format!(
            "  estimated discretisation error: pressure {}, displacement {}, energy norm {}",
            pressures.join(" and "),
            sci(error.displacement, 1),
            sci(error.energy, 1)
        ))
    }

    /// Return the line of a pair. Where two bodies have several pairs, their surfaces name it.
    fn pair_line(&self, pair: &PairReport) -> String {
        let is_only = self.pairs.iter().filter(|other| other.bodies == pair.bodies).count() == 1;
        let [a, b] = if is_only { &pair.bodies } else { &pair.surfaces };
        let names = format!("  {a} - {b}");
        if pair.peak_pressure <= 0.0 || pair.peak_pressure.is_nan() {
            return format!("{names}: no contact");
        }
        format!(
            "{names}: force {}, peak pressure {} at {}, contact {}, open {}",
            vector(pair.force[0]),
            readable(pair.peak_pressure, 6),
            point(pair.peak_at),
            readable(pair.extent.contact(), 6),
            readable(pair.extent.open(), 6)
        )
    }

    /// Return the words on the largest displacement and von Mises stress of all bodies, empty where none is known.
    fn largest_fields(&self) -> String {
        let most = |field: fn(&BodyReport) -> Option<f64>| self.bodies.iter().filter_map(field).reduce(f64::max);
        largest(most(|body| body.max_displacement), most(|body| body.max_von_mises), "")
    }

    /// Return a line per body on its extreme fields and its balance, or one line for many bodies; none before the first iterate.
    fn balance_lines(&self) -> Vec<String> {
        if self.residual.is_none() {
            return Vec::new();
        }
        if self.bodies.len() <= LISTED {
            return self.bodies.iter().map(balance_line).collect();
        }
        let worst = |imbalance: fn(&BalanceReport) -> f64| {
            let all = self.bodies.iter().map(|body| (imbalance(&body.balance), &body.name));
            all.max_by(|a, b| a.0.total_cmp(&b.0))
                .map_or(String::new(), |(most, name)| format!("{} (`{name}`)", sci(most, 1)))
        };
        vec![format!(
            "  {} bodies: {}imbalance at most {} of forces, {} of moments",
            self.bodies.len(),
            self.largest_fields(),
            worst(|balance| balance.force_imbalance),
            worst(|balance| balance.moment_imbalance)
        )]
    }
}

/// Return the words on the largest displacement and von Mises stress, followed by a semicolon; empty where a field is not known.
fn largest(displacement: Option<f64>, von_mises: Option<f64>, place: &str) -> String {
    let (Some(displacement), Some(von_mises)) = (displacement, von_mises) else { return String::new() };
    format!("displacement up to {}, von Mises stress up to {}{place}; ", sci(displacement, 3), readable(von_mises, 6))
}

/// Return the line of a load step; `number` counts from 1.
fn step_line(number: usize, step: &StepReport) -> String {
    let pairs = match step.pairs.len() {
        ..=LISTED => {
            let pairs = step.pairs.iter().map(|pair| {
                let (peak, force) = (readable(pair.peak_pressure, 6), vector(pair.force));
                format!("force {force}, peak pressure {peak}, {} points closed", pair.closed)
            });
            pairs.collect::<Vec<_>>().join("; ")
        }
        count => {
            let peak = step.pairs.iter().map(|pair| pair.peak_pressure).fold(0.0, f64::max);
            let closed: usize = step.pairs.iter().map(|pair| pair.closed).sum();
            format!("{count} pairs, peak pressure {}, {closed} points closed", readable(peak, 6))
        }
    };
    let factors = step.factors.iter().map(|(name, factor)| format!("{name} {}", readable(*factor, 4)));
    let factors = factors.collect::<Vec<_>>().join(", ");
    format!("  step {number}, {factors}: {} iterations, {}: {pairs}", step.iterations, step.status)
}

/// Return the line of a body with its reactions and imbalances.
fn balance_line(body: &BodyReport) -> String {
    let BalanceReport { supports, springs, rigid, force_imbalance, moment_imbalance, .. } = &body.balance;
    let named = |verb: &str, parts: &mut dyn Iterator<Item = &ForceReport>| {
        let all: Vec<_> = parts.map(|part| format!("{} {}", part.on, vector(part.force))).collect();
        if all.is_empty() { String::new() } else { format!("{verb} {}; ", all.join(", ")) }
    };
    let reactions = named("held by", &mut supports.iter().chain(springs)) + &named("rigid", &mut rigid.iter());
    let place = body.max_von_mises_at.map_or(String::new(), |x| format!(" at {}", point(x)));
    let fields = largest(body.max_displacement, body.max_von_mises, &place);
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

/// Format the coordinates of a point.
fn point(x: [f64; 3]) -> String {
    format!("({})", x.map(|x| readable(x, 4)).join(", "))
}

/// Format a vector.
fn vector(v: [f64; 3]) -> String {
    format!("({})", v.map(|v| readable(v, 6)).join(", "))
}

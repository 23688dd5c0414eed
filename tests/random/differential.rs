//! [`Differential`]: a scene run in several ways, every pair of which must agree, and its tables with its audits.
//!
//! A run counts if the program vouches for it: completed, and within what the audit lets pass. One that is refused with a
//! code, ends early, or is marked as doubtful, is not silently wrong; such runs are counted, and their share is bounded.

use std::collections::BTreeMap;

use odyn::results::{ChannelInfo, Status};
use odyn::session::RunReport;

use super::checks::{Checks, below, column, largest};
use super::furnish::DURATION;
use super::mechanism::{Mechanism, Place};
use super::numbers::Random;

/// Tolerance of the runs, and of those that are to be more accurate.
pub const TOLERANCE: f64 = 1e-9;
const SHARPER: f64 = 1e-11;
/// Differences may be this many times what tolerances and sensitivity explain.
const FACTOR: f64 = 30.0;
/// The same for loads, which follow from accelerations.
const FACTOR_OF_LOADS: f64 = 1000.0 * FACTOR;
/// Steps of which each may be off by the tolerance before their number counts.
const MANY_STEPS: f64 = 200.0;
/// Beyond this share of the peak in the twin, nothing can be said any more.
const CHAOTIC: f64 = 1e-4;
/// A scene counts as compared closely if the allowed difference of its motion is below this share of the peak.
pub const CLOSE: f64 = 1e-6;
/// What the audit lets pass: violations, energy.
const VIOLATION: f64 = 1e-8;
const ENERGY: f64 = 1e-6;
/// Methods of lower order.
const IMPLICIT: [&str; 2] = ["method=radau5", "method=auto"];
/// Seeds that are named for runs without a result.
const MOST_SEEDS: usize = 8;
/// A difference of at most so many times what is allowed is explained by the tolerance if it falls by a factor with a
/// tolerance [`REFINED`] times as large.
const MOST_EXPLAINED: f64 = 100.0;
const REFINED: f64 = 0.01;
const FALLEN: f64 = 5.0;
/// The tightest tolerance of such runs.
const TIGHTEST: f64 = 1e-13;
/// The code of a way that is not offered for a scene.
const NOT_OFFERED: &str = "3 ODY0320";
/// How a run ends whose motion depends on reactions that are not unique.
const UNDETERMINED: &str = "7 ODY0322";
/// A share of a metre, a metre per second, a radian per second that matters however little moves.
const ORDINARY: f64 = 1e-2;
/// Forces (N) and torques (N m) whose share counts as that of a force of this size: a spring of some N/m at rest has the round-off
/// of coordinates of about a metre.
const NO_LOAD: f64 = 1e-7;
/// Steps after which a run is given up.
const MOST_STEPS: &str = "max_steps=20000";

/// How a run ended.
pub enum Ending {
    /// The program vouches for it.
    Sound(Box<RunReport>),
    /// Refused, ended early or doubtful, with what stands for it: exit code and message code.
    Refused(String),
}

/// What a way of running a scene allows its results to be off, beside its sensitivity.
struct Way {
    settings: Vec<String>,
    tolerance: f64,
    /// How many times its tolerance it may be off, as a share of what others may.
    looser: f64,
}

/// What was seen in all scenes.
#[derive(Default)]
pub struct Seen {
    pub scenes: u64,
    /// Runs that the program vouches for.
    pub sound: u64,
    /// Others, by exit code and code, with the seeds of some.
    pub refused: BTreeMap<String, (u64, Vec<u64>)>,
    /// Scenes with two sound runs, and those of which the motion was compared to better than [`CLOSE`].
    pub compared: u64,
    pub close: u64,
    /// Seeds of scenes of which rigid bodies do not determine the motion, which the program says of every run.
    pub undetermined: Vec<u64>,
    /// Seeds of scenes with differences beyond what is allowed that fall with the tolerance.
    pub converging: Vec<u64>,
    /// Shares of the allowed difference that were taken up, by decade below one.
    pub taken: BTreeMap<i32, u64>,
}

impl Seen {
    /// Share of the runs that the program does not vouch for.
    pub fn refusals(&self) -> f64 {
        let refused: u64 = self.refused.values().map(|(count, _)| count).sum();
        refused as f64 / (refused + self.sound).max(1) as f64
    }
}

impl std::fmt::Display for Seen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "{} scenes, {} compared, {} of them closely; {} sound runs",
            self.scenes, self.compared, self.close, self.sound
        )?;
        writeln!(f, "beyond what is allowed, but falling with the tolerance: {:?}", self.converging)?;
        writeln!(f, "motion not determined: {:?}", self.undetermined)?;
        writeln!(f, "not sound {:.1} %: {:?}", 100.0 * self.refusals(), self.refused)?;
        write!(f, "decades of the allowed difference: {:?}", self.taken)
    }
}

impl Way {
    fn new(settings: &[&str], tolerance: f64) -> Self {
        let all = settings.iter().copied().chain([MOST_STEPS]).map(str::to_owned);
        // Errors of implicit methods, of order 3 to 5, add up over more steps.
        let looser = if settings.iter().any(|text| IMPLICIT.contains(text)) { 10.0 } else { 1.0 };
        Self { settings: all.chain([format!("tolerance={tolerance:e}")]).collect(), tolerance, looser }
    }

    /// The same at another tolerance.
    fn refined(&self) -> Self {
        let tolerance = (REFINED * self.tolerance).max(TIGHTEST);
        let others = self.settings.iter().filter(|text| !text.starts_with("tolerance="));
        let settings = others.cloned().chain([format!("tolerance={tolerance:e}")]).collect();
        Self { settings, tolerance, ..*self }
    }

    fn name(&self) -> String {
        self.settings.iter().filter(|text| *text != MOST_STEPS).cloned().collect::<Vec<_>>().join(" ")
    }
}

/// The ways in which a scene is run; the first is the usual one.
fn ways(seed: u64) -> Vec<Way> {
    let longest = format!("max_step={:?}", DURATION / 200.0);
    let other = Random::new(seed ^ 0x3e7_40d5).below(6);
    let third: &[&str] = [
        &["formulation=joint", "method=radau5"][..],
        &["formulation=cartesian", "method=radau5"],
        &["formulation=joint", "method=auto"],
        &["formulation=cartesian", "method=auto"],
        &["formulation=joint", "method=dopri5"],
        &["formulation=cartesian", "method=dopri5"],
    ][other];
    let mut ways = vec![
        Way::new(&["formulation=joint"], TOLERANCE),
        Way::new(&["formulation=cartesian"], TOLERANCE),
        Way::new(third, TOLERANCE),
        Way::new(&["formulation=cartesian"], SHARPER),
        Way::new(&["formulation=auto", &longest], SHARPER),
    ];
    if seed.is_multiple_of(4) {
        ways.push(Way::new(&["engine=reference"], TOLERANCE));
    }
    ways
}

/// The keys of `[simulation]` of the scenes.
pub fn keys() -> String {
    format!("t_end = {DURATION:?}\noutput_step = {:?}\ntolerance = {TOLERANCE:e}", DURATION / 20.0)
}

/// What differences in columns are a share of: the largest of what is of the same kind in the scene, or of the same part.
fn scales(report: &RunReport) -> Vec<f64> {
    let peak = |fits: &dyn Fn(&str) -> bool| {
        let named = report.channels.iter().zip(&report.columns).filter(|(channel, _)| fits(&channel.name));
        largest(named.flat_map(|(_, values)| values.iter().copied()))
    };
    let all = |letter: char| peak(&|name: &str| name.starts_with(letter));
    let motion: BTreeMap<char, f64> =
        ['r', 'v', 'w', 'p', 'e'].into_iter().map(|letter| (letter, all(letter))).collect();
    let heaviest = all('F').max(all('T'));
    let size = |channel: &ChannelInfo| {
        let (name, plain) = (channel.name.as_str(), channel.unit.is_empty() || channel.unit == "1");
        let letter = name.chars().next().unwrap_or_default();
        match letter {
            // `F_part_body_x`: forces and torques of a part stand for each other by a lever of a metre, of which torques are a share.
            'F' | 'T' => {
                let own = name[1..].rsplitn(3, '_').last().unwrap_or_default();
                let of = |letter: char| peak(&|other: &str| other.starts_with(letter) && other[1..].starts_with(own));
                let (same, lever) = if letter == 'F' { (of('F'), of('T')) } else { (of('T'), of('F')) };
                same.max(1e-2 * lever).max(1e-9 * heaviest).max(NO_LOAD)
            }
            'y' => peak(&|other: &str| other == name).max(if plain { ORDINARY } else { 1e-9 * heaviest }),
            // Scenes are of metres, seconds and radians.
            'e' => motion[&letter],
            _ => motion.get(&letter).copied().unwrap_or(0.0).max(ORDINARY),
        }
    };
    report.channels.iter().map(|channel| size(channel).max(f64::MIN_POSITIVE)).collect()
}

/// Largest difference of each column.
fn differences(a: &RunReport, b: &RunReport) -> Vec<f64> {
    let pairs = a.columns.iter().zip(&b.columns);
    pairs.map(|(a, b)| largest(a.iter().zip(b).map(|(a, b)| a - b))).collect()
}

/// What must hold of a run by itself: the table against the audit, and loads against accelerations.
fn sound(report: &RunReport) -> Result<(), String> {
    let finite = report.columns.iter().flatten().all(|value| value.is_finite());
    if !finite {
        return Err("table: not finite".into());
    }
    let audit = &report.summary.audit;
    let energy = column(report, "energy");
    // What the table says was gained is the work that the audit says was done.
    if let [first, .., last] = energy {
        let scale = largest(energy.iter().map(|e| e - first)).max(audit.largest_energy()).max(audit.work.abs());
        let stored = 1e-6 * largest(energy.iter().copied());
        let off = (last - first - audit.work).abs();
        below("table: energy against the audit's work", off / scale.max(stored).max(f64::MIN_POSITIVE), 10.0 * ENERGY)?;
    }
    // A sample in which energy jumps and comes back was not on the trajectory that the audit looked at.
    let heat = audit.dissipated.abs() + audit.work.abs();
    let conservative = heat <= 1e-9 * largest(energy.iter().copied());
    if conservative {
        let off = largest(energy.iter().map(|e| e - energy[0]));
        let scale = largest(energy.iter().copied()).max(audit.kinetic_energy).max(f64::MIN_POSITIVE);
        below("table: energy within a conservative run", off / scale, 10.0 * ENERGY)?;
    }
    let peak = |letters: [char; 2]| {
        let named = report.channels.iter().zip(&report.columns).filter(|(c, _)| c.name.starts_with(letters));
        largest(named.flat_map(|(_, column)| column.iter().copied()))
    };
    let loads = peak(['F', 'T']).max(largest(energy.iter().copied())).max(f64::MIN_POSITIVE);
    below("table: balance of loads", peak(['f', 't']) / loads, 1e-7)
}

impl Mechanism {
    /// The same with everything at the start moved by about this share.
    fn nearby(&self, by: f64, seed: u64) -> Self {
        let mut random = Random::new(seed ^ 0x7715);
        let mut other = self.clone();
        let share = by * random.between(0.5, 1.0);
        for body in &mut other.bodies {
            body.velocity *= 1.0 + share;
            body.spin *= 1.0 + share;
            body.velocity += random.vector(by);
            body.spin += random.vector(by);
            body.origin += random.vector(by);
        }
        other
    }
}

impl Checks {
    /// Runs a scene.
    fn ending(&self, text: &str, way: &Way) -> Ending {
        let settings: Vec<&str> = way.settings.iter().map(String::as_str).collect();
        let report = self
            .session(text, &settings)
            .and_then(|session| session.run(None, Box::new(|_| ()), &std::sync::Arc::default()));
        match report {
            Err(error) => {
                let code = error.diagnostics.iter().find(|d| d.is_error()).map_or("?", |d| d.code.code);
                Ending::Refused(format!("{} {code}", error.exit_code()))
            }
            Ok(report) if report.summary.status != Status::Completed => {
                Ending::Refused(format!("{} {}", report.exit_code(), report.summary.code.map_or("?", |code| code.code)))
            }
            Ok(report) => {
                let audit = &report.summary.audit;
                let violation = audit.position_violation.max(audit.velocity_violation);
                let fits = violation <= VIOLATION && audit.energy_error_relative <= ENERGY.max(1e4 * way.tolerance);
                if fits { Ending::Sound(Box::new(report)) } else { Ending::Refused("7 audit".into()) }
            }
        }
    }

    /// Whether a difference in a column falls with the tolerance of both ways.
    fn converges(&self, text: &str, ways: [&Way; 2], column: usize, difference: f64) -> bool {
        let again = ways.map(|way| self.ending(text, &way.refined()));
        let [Ending::Sound(one), Ending::Sound(other)] = &again else { return false };
        differences(one, other)[column] <= difference / FALLEN
    }

    /// All pairs of ways of running a mechanism agree.
    pub fn differ(&self, mechanism: &Mechanism, seed: u64, seen: &mut Seen) -> Result<(), String> {
        let text = mechanism.text(&Place::as_it_is(), &keys());
        let nearby = mechanism.nearby(TOLERANCE, seed).text(&Place::as_it_is(), &keys());
        self.agree(&text, &nearby, seed, seen)
    }

    /// All pairs of ways of running a scene agree, to what the difference from a scene nearby allows.
    pub fn agree(&self, text: &str, nearby: &str, seed: u64, seen: &mut Seen) -> Result<(), String> {
        seen.scenes += 1;
        let mut runs = Vec::new();
        for way in ways(seed) {
            match self.ending(text, &way) {
                Ending::Sound(report) => {
                    seen.sound += 1;
                    runs.push((way, report));
                }
                Ending::Refused(code) => {
                    // Forces that take reactions have no joint coordinates.
                    if code == NOT_OFFERED {
                        continue;
                    }
                    // Whatever way reached the end, it was said; there is nothing to compare.
                    if code == UNDETERMINED {
                        if let Some((way, _)) = runs.first() {
                            return Err(format!(
                                "the motion is not determined, and is said to be sound: {}",
                                way.name()
                            ));
                        }
                        seen.undetermined.push(seed);
                        return Ok(());
                    }
                    let hunted = std::env::var("ODYN_RANDOM_HUNT").is_ok_and(|hunted| hunted == code);
                    if hunted || code.starts_with("3 ") || code.starts_with("4 ") {
                        return Err(format!("refused: {} {code}", way.name()));
                    }
                    let (count, seeds) = seen.refused.entry(code).or_default();
                    *count += 1;
                    if seeds.len() < MOST_SEEDS && !seeds.contains(&seed) {
                        seeds.push(seed);
                    }
                }
            }
        }
        for (way, report) in &runs {
            sound(report).map_err(|why| format!("{why} ({})", way.name()))?;
        }
        let Some((way, first)) = runs.first() else { return Ok(()) };
        let Ending::Sound(twin) = self.ending(nearby, way) else { return Ok(()) };
        if runs.len() < 2 {
            return Ok(());
        }
        let scales = scales(first);
        let sensitivity: Vec<f64> = differences(first, &twin).iter().zip(&scales).map(|(d, scale)| d / scale).collect();
        let is_load = |name: &str| name.starts_with(['F', 'T', 'y']);
        // The motion's sensitivity is that of all of it: what is small now may grow.
        let motion =
            first.channels.iter().zip(&sensitivity).filter(|(channel, _)| channel.name.starts_with(['r', 'v', 'w']));
        let moved = largest(motion.map(|(_, share)| *share));
        if moved > CHAOTIC {
            return Ok(());
        }
        seen.compared += 1;
        let (mut worst, mut closest): (Option<(f64, String)>, f64) = (None, f64::INFINITY);
        let mut explained = false;
        for (k, (way, run)) in runs.iter().enumerate() {
            for (other_way, other) in &runs[k + 1..] {
                let tolerance = way.tolerance + other_way.tolerance;
                for (c, difference) in differences(run, other).into_iter().enumerate() {
                    let channel = &run.channels[c];
                    let determined = channel.unique && other.channels[c].unique;
                    if (is_load(&channel.name) && !determined) || channel.name.starts_with(['f', 't']) {
                        continue;
                    }
                    let factor = if is_load(&channel.name) { FACTOR_OF_LOADS } else { FACTOR };
                    let factor = factor * way.looser.max(other_way.looser);
                    // Errors of steps add up.
                    let steps = run.summary.steps.max(other.summary.steps) as f64;
                    let one = tolerance * (1.0 + moved.max(sensitivity[c]) / TOLERANCE);
                    let allowed = factor * one * (1.0 + steps / MANY_STEPS);
                    if channel.name.starts_with(['r', 'v', 'w']) {
                        closest = closest.min(allowed);
                    }
                    let share = difference / scales[c] / allowed;
                    if (1.0..MOST_EXPLAINED).contains(&share) && self.converges(text, [way, other_way], c, difference) {
                        explained = true;
                        continue;
                    }
                    if share > worst.as_ref().map_or(0.0, |(most, _)| *most) || share.is_nan() {
                        let (one, two) = (way.name(), other_way.name());
                        let found = difference / scales[c];
                        worst = Some((
                            share,
                            format!(
                                "`{}` differs by {found:.1e} of the peak, allowed {allowed:.0e}: {one} | {two}",
                                channel.name
                            ),
                        ));
                    }
                }
            }
        }
        seen.close += u64::from(closest < CLOSE);
        if explained {
            seen.converging.push(seed);
        }
        let Some((share, words)) = worst else { return Ok(()) };
        *seen.taken.entry(share.max(1e-12).log10().ceil() as i32).or_default() += 1;
        if share <= 1.0 { Ok(()) } else { Err(format!("pair: {words}")) }
    }
}

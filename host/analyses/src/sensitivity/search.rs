//! [`Search`]: the step h of each parameter, and the derivatives with their errors.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::runs::{Done, Kind, Nominal, Variants, Way};
use super::{Parameter, Request, Stencil, Wanted, is_none};
use crate::diagnostics::{Diagnostic, codes};
use crate::pool;
use crate::results::Remedy;
use crate::session::SessionError;

/// h that is tried first, as a share of the parameter.
const FIRST: f64 = 1e-3;
/// Steps that are tried for one parameter.
const MOST_ROUNDS: usize = 5;
/// Relative error of differences at which no other step is tried.
const GOOD: f64 = 3e-11;
/// Relative error that a smaller step is chosen for, where differences leave out too much.
const AIM: f64 = 1e-12;
/// Share of the derivative of order 2 by which that of order 4 may differ, before the step is far too large.
const FAR_TOO_LARGE: f64 = 0.05;
/// Share of the derivative of order 2 by which that of order 4 may differ without a second step where order 6 agrees with this one.
const UNLIKELY: f64 = 1e-3;
/// Least derivative, as a share of what the largest value over the parameter would be, that the step is judged by.
const LEAST: f64 = 1e-7;
/// Share of an output by which round-off changes its differences, at least.
const ROUND_OFF: f64 = 2.0 * f64::EPSILON;
/// Share of the largest derivative by which differences disagree where what is differenced is not smooth.
const DISAGREE: f64 = 1e-2;
/// One of so many samples may not be smooth, without all being doubtful.
const FEW: usize = 10;
/// Samples on each side whose errors count for one.
const NEIGHBOURS: usize = 3;
/// Multiples of what a round leaves open by which another one may be apart from it, or the slopes on both sides.
const APART: f64 = 10.0;
/// The same for slopes on both sides before a step is judged by them: round-off is that much larger in them, and now and then small in the
/// rest.
const BENT: f64 = 100.0;
/// Share of an output that differences for one step may leave open of it where round-off is what they leave open.
const NOISE: f64 = 1e-9;
/// Tolerances of runs that take their own steps, and the least of those that follow.
const OWN_STEPS: [f64; 2] = [1e-13, 1e-12];
/// Ratio of the tolerances of runs that follow steps.
const RATIO: f64 = 100.0;

/// The derivatives by one parameter, outputs at all samples one after the other, then figures.
pub(super) struct Found {
    pub(super) derivative: Vec<f64>,
    pub(super) error: Vec<f64>,
    pub(super) step: f64,
    pub(super) stencil: Stencil,
    pub(super) runs: usize,
    pub(super) tolerance: Option<f64>,
    pub(super) notes: Vec<String>,
}

/// What is looked for.
pub(super) struct Search<'a> {
    pub(super) variants: &'a Variants,
    pub(super) wanted: &'a Wanted,
    pub(super) request: &'a Request,
    /// What is natural for each output that is wanted.
    pub(super) natural: &'a [f64],
    /// Times of the samples.
    pub(super) times: &'a [f64],
    pub(super) progress: &'a (dyn Fn(f64) + Sync),
}

/// What is kept of a run.
struct Sampled {
    values: Vec<f64>,
    /// Whether its samples are at other times.
    elsewhere: bool,
    samples: usize,
    /// What happened to each row: samples before it, what.
    events: BTreeMap<String, Vec<(usize, &'static str)>>,
    switches: u64,
}

impl Sampled {
    fn values(all: &[Self]) -> Vec<&[f64]> {
        all.iter().map(|one| one.values.as_slice()).collect()
    }
}

/// The runs of one parameter at one step.
struct Round {
    share: f64,
    stencil: Stencil,
    values: Vec<Sampled>,
    /// Of each column, as shares of its largest derivative: by how much orders 6 and 4 differ, and orders 4 and 2, or slopes on both sides;
    /// the first of them for one step as a share of the output, too.
    errors: Vec<[f64; 3]>,
    /// Samples that events pass.
    marked: Vec<bool>,
}

impl Round {
    /// The column that is worst in the best of all rounds for it.
    fn worst(rounds: &[Self]) -> Option<(usize, f64)> {
        let best = |column: usize| (column, rounds[choice(rounds, column)].errors[column][0]);
        (0..rounds.first()?.errors.len()).map(best).max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The round that is best for a column, of those in which events pass fewest samples.
fn choice(rounds: &[Round], column: usize) -> usize {
    let passed = |number: usize| rounds[number].marked.iter().filter(|marked| **marked).count();
    let least = (0..rounds.len()).map(passed).min().unwrap_or(0);
    let error = |number: &usize| rounds[*number].errors[column][0];
    let good = (0..rounds.len()).filter(|number| passed(*number) == least);
    good.min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(0)
}

impl Search<'_> {
    /// All parameters.
    pub(super) fn all(&self, nominal: &Nominal, parameters: &[Parameter]) -> Result<Vec<Found>, SessionError> {
        let tolerances = match nominal.kind {
            Kind::Frozen => {
                let fine = (nominal.tolerance / RATIO).max(OWN_STEPS[0]).min(nominal.tolerance);
                [fine, RATIO * fine]
            }
            _ => OWN_STEPS,
        };
        let fine = self.variants.level(nominal, &[], tolerances[0], 0.5)?;
        let coarse = self.variants.level(nominal, &[], tolerances[1], 1.0)?;
        let there = sampled(&self.variants.run(&[], &fine)?, self.wanted, self.times).values;
        let ended = AtomicUsize::new(0);
        let expected = parameters.len() * (Stencil::Central.places().len() + 2);
        let progress = || {
            let ended = ended.fetch_add(1, Ordering::Relaxed) + 1;
            (self.progress)((ended as f64 / expected as f64).min(0.99));
        };
        let first = self.request.step.unwrap_or(FIRST);
        let mut open: Vec<(usize, f64, Stencil)> =
            (0..parameters.len()).map(|number| (number, first, Stencil::Central)).collect();
        let mut all: Vec<Vec<Round>> = parameters.iter().map(|_| Vec::new()).collect();
        let mut runs = vec![0; parameters.len()];
        for round in 0..MOST_ROUNDS {
            let mut next = Vec::new();
            let made = self.rounds(parameters, &open, (round == 0, &fine, &there), &progress);
            for ((number, share, stencil), made) in open.iter().zip(made) {
                runs[*number] += stencil.places().len();
                let rounds = &mut all[*number];
                let made = match made {
                    Ok(made) => made,
                    // A step that was only tried may lead to where the scene does not run.
                    Err(_) if !rounds.is_empty() => continue,
                    Err(error) => return Err(error),
                };
                let before = Round::worst(rounds);
                rounds.push(made);
                let sized = parameters[*number].value != 0.0;
                let wanted = next_share(rounds, before, sized).filter(|_| self.request.step.is_none());
                // Where the scene did not run on one side, it need not there with a smaller step.
                let stencil = rounds[0].stencil;
                next.extend(wanted.filter(|wanted| wanted != share).map(|wanted| (*number, wanted, stencil)));
            }
            open = next;
            if open.is_empty() {
                break;
            }
        }
        let mut found = Vec::new();
        for ((parameter, rounds), runs) in parameters.iter().zip(all).zip(runs) {
            // What the steps leave out is seen at the step that most columns take.
            let choices: Vec<usize> = (0..rounds[0].errors.len()).map(|column| choice(&rounds, column)).collect();
            let most = |number: &usize| choices.iter().filter(|choice| *choice == number).count();
            let main = (0..rounds.len()).max_by_key(most).unwrap_or(0);
            let (stencil, step) = (rounds[main].stencil, rounds[main].share * base(parameter.value));
            let places = &stencil.places()[..stencil.fewest()];
            let jobs = places.iter().map(|place| parameter.value + place * step).collect();
            let one = |value: f64| {
                let done = self.at(parameter, value, &coarse);
                progress();
                done
            };
            let rough: Result<Vec<Sampled>, _> = pool::each(jobs, self.request.jobs, one).into_iter().collect();
            let runs = runs + places.len();
            let judged = self.judge(nominal, parameter, (&rounds, &choices, main), (&there, &rough?));
            let tolerance = Some(tolerances[0]).filter(|_| !matches!(nominal.kind, Kind::Fixed(_)));
            found.push(Found { runs, tolerance, ..judged });
        }
        Ok(found)
    }

    /// One round of each of these parameters at these steps.
    fn rounds(
        &self,
        parameters: &[Parameter],
        open: &[(usize, f64, Stencil)],
        (first, fine, there): (bool, &Way, &[f64]),
        progress: &(dyn Fn() + Sync),
    ) -> Vec<Result<Round, SessionError>> {
        let places = |stencil: Stencil, number: usize, share: f64| {
            let parameter = &parameters[number];
            let step = share * base(parameter.value);
            stencil.places().iter().map(move |place| (number, parameter.value + place * step))
        };
        let one = |(number, value): (usize, f64)| {
            let done = self.at(&parameters[number], value, fine);
            progress();
            done
        };
        let jobs = open.iter().flat_map(|(number, share, stencil)| places(*stencil, *number, *share)).collect();
        let mut done = pool::each(jobs, self.request.jobs, one).into_iter();
        open.iter()
            .map(|(number, share, tried)| {
                let own: Vec<Result<Sampled, SessionError>> = done.by_ref().take(tried.places().len()).collect();
                self.at_these_times(&parameters[*number], &own)?;
                let fails = |side: usize| own.iter().skip(side).step_by(2).any(Result::is_err);
                // Places alternate: below, above.
                let stencil = match (tried, fails(0), fails(1)) {
                    (Stencil::Central, true, false) => Stencil::Forward,
                    (Stencil::Central, false, true) => Stencil::Backward,
                    _ => *tried,
                };
                let own = if stencil == *tried || !first {
                    own
                } else {
                    pool::each(places(stencil, *number, *share).collect(), self.request.jobs, one)
                };
                self.at_these_times(&parameters[*number], &own)?;
                let values: Vec<Sampled> = own.into_iter().collect::<Result<_, _>>()?;
                Ok(self.round(&parameters[*number], (*share, stencil), there, values))
            })
            .collect()
    }

    fn at(&self, parameter: &Parameter, value: f64, way: &Way) -> Result<Sampled, SessionError> {
        let done = self.variants.run(&[parameter.set(value)], way).map_err(|mut error| {
            if let Some(first) = error.diagnostics.first_mut() {
                let at = format!("with {} = {}", parameter.key, parameter.shown(value, 9));
                let report = Diagnostic::error(first.code, format!("{at}: {}", first.message));
                *first = first.help.iter().fold(report, |report, help| report.help(help.clone()));
            }
            error
        })?;
        Ok(sampled(&done, self.wanted, self.times))
    }

    /// Runs have to have their samples at the same times, on either side: a number that moves one is not differentiated by.
    fn at_these_times(
        &self,
        parameter: &Parameter,
        runs: &[Result<Sampled, SessionError>],
    ) -> Result<(), SessionError> {
        if !runs.iter().flatten().any(|run| run.elsewhere) {
            return Ok(());
        }
        let message = format!("`{}` changes the times of the samples, at which derivatives are taken", parameter.key);
        let error = Diagnostic::error(codes::BAD_OVERRIDE, message);
        let help = "give the times of the simulation as numbers of their own";
        Err(SessionError::one(self.variants.document.source(), error.help(help)))
    }

    /// Judges a round, column by column. `there`: what is differenced, at the parameter's own value.
    fn round(
        &self,
        parameter: &Parameter,
        (share, stencil): (f64, Stencil),
        there: &[f64],
        values: Vec<Sampled>,
    ) -> Round {
        let step = share * base(parameter.value);
        let rows = Sampled::values(&values);
        let (count, marked) = (rows[0].len(), passed(&values));
        let samples = self.samples(count);
        let of_outputs = samples * self.wanted.outputs.len();
        let good = |k: &usize| rows[0][*k].is_finite() && (*k >= of_outputs || !marked[*k % samples]);
        let errors = columns(self.wanted, count).enumerate().map(|(number, column)| {
            let natural = self.natural.get(number).copied().unwrap_or(0.0);
            let (mut size, mut level, mut errors, mut bends) = (0.0_f64, natural, [0.0_f64; 2], [0.0_f64; 2]);
            for k in column.filter(good) {
                let [d2, d4, d6] = [0, 1, 2].map(|order| stencil.derivative(order, &rows, k, step));
                size = size.max(d6.abs());
                level = level.max(rows[0][k].abs());
                errors = [errors[0].max((d6 - d4).abs()), errors[1].max((d4 - d2).abs())];
                bends = [0, 1].map(|order| bends[order].max(stencil.bend(order, there, &rows, k, step).abs()));
            }
            let base = base(parameter.value);
            let round_off = ROUND_OFF * level / step;
            if bends[1] > BENT * errors[0].max(round_off) {
                errors[0] = bends[1];
            }
            if bends[0] > UNLIKELY * size {
                errors[1] = errors[1].max(bends[0]);
            }
            let least = errors[0].max(round_off);
            // What the number does not change is nothing but round-off, which grows smaller with every larger step.
            let none = is_none(size * base, least * base, level);
            let size = size.max(LEAST * level / base);
            let [fine, rough] = errors;
            if size > 0.0 && !none { [fine / size, rough / size, fine * step / level] } else { [0.0; 3] }
        });
        let errors = errors.collect();
        Round { share, stencil, errors, marked, values }
    }

    /// Samples of a run with so many values.
    fn samples(&self, values: usize) -> usize {
        (values - self.wanted.figures.len()) / self.wanted.outputs.len().max(1)
    }

    fn judge(
        &self,
        nominal: &Nominal,
        parameter: &Parameter,
        (rounds, choices, main): (&[Round], &[usize], usize),
        (there, rough): (&[f64], &[Sampled]),
    ) -> Found {
        let rows: Vec<Vec<&[f64]>> = rounds.iter().map(|round| Sampled::values(&round.values)).collect();
        let others = Sampled::values(rough);
        let step = |round: usize| rounds[round].share * base(parameter.value);
        let of = |round: usize, order: usize, k: usize| {
            rounds[round].stencil.derivative(order, &rows[round], k, step(round))
        };
        let count = rows[0][0].len();
        let (mut derivative, mut error) = (vec![f64::NAN; count], vec![f64::NAN; count]);
        let mut disagree = 0;
        for (number, (column, round)) in columns(self.wanted, count).zip(choices).enumerate() {
            let mut own = Vec::new();
            for k in column.clone() {
                let of_steps = of(main, 0, k) - rounds[main].stencil.derivative(0, &others, k, step(main));
                derivative[k] = of(*round, 2, k);
                own.push((derivative[k] - of(*round, 1, k)).abs() + of_steps.abs());
            }
            let level = column.clone().map(|k| rows[*round][0][k].abs()).filter(|x| x.is_finite());
            let natural = self.natural.get(number).copied().unwrap_or(0.0);
            let least = ROUND_OFF * level.fold(natural, f64::max) / step(*round);
            // At a kink all central differences agree.
            let open = own.clone();
            for (place, k) in column.clone().enumerate() {
                let bend = rounds[*round].stencil.bend(1, there, &rows[*round], k, step(*round)).abs();
                if bend > APART * largest_near(&open, place, least) {
                    own[place] = own[place].max(bend);
                }
            }
            // Where another round is elsewhere by more than it leaves open, orders agree by chance in this one: a kink between its runs. Not
            // so where the kink is between those of a larger step only.
            let tells = |other: &usize| {
                let of = |round: usize| (rounds[round].share, rounds[round].errors[number][2]);
                other != round && (of(*other).0 < of(*round).0 || of(*other).1 <= NOISE)
            };
            for other in (0..rounds.len()).filter(tells) {
                let open: Vec<f64> = column.clone().map(|k| (of(other, 2, k) - of(other, 1, k)).abs()).collect();
                for (place, k) in column.clone().enumerate() {
                    let apart = (derivative[k] - of(other, 2, k)).abs() - APART * largest_near(&open, place, 0.0);
                    own[place] = own[place].max(apart);
                }
            }
            let rough = not_smooth(&derivative[column.clone()], &own);
            for (k, own) in
                column.clone().zip(&mut own).enumerate().filter(|(place, _)| rough[*place]).map(|(_, at)| at)
            {
                (derivative[k], *own) = (f64::NAN, f64::NAN);
            }
            if number < self.wanted.outputs.len() {
                disagree += rough.iter().filter(|rough| **rough).count();
            }
            // Differences that agree by chance say nothing: those of neighbours count, and what round-off leaves at least.
            for (place, k) in column.enumerate() {
                error[k] = if rough[place] { f64::NAN } else { largest_near(&own, place, least) };
            }
        }
        let mut notes = Vec::new();
        let samples = self.samples(count);
        let mut marked = vec![false; samples];
        for round in choices.iter().chain([&main]) {
            marked.iter_mut().zip(&rounds[*round].marked).for_each(|(marked, passed)| *marked |= passed);
        }
        let many = marked.iter().filter(|marked| **marked).count();
        if many > 0 {
            for k in (0..samples * self.wanted.outputs.len()).filter(|k| marked[k % samples]) {
                (derivative[k], error[k]) = (f64::NAN, f64::NAN);
            }
            notes.push(format!(
                "{many} samples have no derivative by `{}`: an event passes them between the runs, or what happens before them differs",
                parameter.key
            ));
        }
        if disagree > 0 {
            notes.push(format!(
                "{disagree} values have no derivative by `{}`: the differences disagree, as where equations switch",
                parameter.key
            ));
        }
        let values = &rounds[main].values;
        if nominal.kind == Kind::Located && values.iter().any(|one| one.switches != values[0].switches) {
            notes.push(format!("the number of switches differs between the runs around `{}`", parameter.key));
        }
        let (step, stencil) = (step(main), rounds[main].stencil);
        Found { derivative, error, step, stencil, runs: 0, tolerance: None, notes }
    }
}

/// The largest error of a sample and its neighbours, and at least so much.
fn largest_near(errors: &[f64], place: usize, least: f64) -> f64 {
    let near = &errors[place.saturating_sub(NEIGHBOURS)..(place + NEIGHBOURS + 1).min(errors.len())];
    near.iter().copied().fold(least, f64::max)
}

/// Values of a column at which differences disagree, where they agree at nine of ten others. `own` are their errors.
fn not_smooth(derivative: &[f64], own: &[f64]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..own.len()).collect();
    order.sort_by(|a, b| own[*a].total_cmp(&own[*b]));
    let (good, others) = order.split_at(own.len() - own.len() / FEW);
    let size = good.iter().map(|k| derivative[*k].abs()).fold(0.0, f64::max);
    let mut rough = vec![false; own.len()];
    if good.iter().all(|k| own[*k] <= DISAGREE * size) {
        others.iter().for_each(|k| rough[*k] = own[*k] > DISAGREE * size);
    }
    rough
}

/// What a share of a parameter of this value is a share of.
pub(crate) fn base(value: f64) -> f64 {
    if value == 0.0 { 1.0 } else { value.abs() }
}

/// The next step to try, if any: for the column that is worst so far. `before`: what was worst before the last round; `sized`: whether the
/// number is not 0, so that its first step is a share of it.
fn next_share(rounds: &[Round], before: Option<(usize, f64)>, sized: bool) -> Option<f64> {
    let (column, error) = Round::worst(rounds)?;
    let last = rounds.last()?;
    let passed = |round: &Round| round.marked.iter().filter(|marked| **marked).count();
    let passes_more = rounds.iter().any(|round| passed(round) < passed(last));
    // A smooth function whose order 2 is off by so much leaves about its square to order 4. Less is that of a polynomial, or chance.
    let by_chance = |[fine, rough, _]: &[f64; 3]| *rough > UNLIKELY && *fine < 0.1 * rough * rough;
    if rounds.len() == 1 && last.errors.iter().any(by_chance) {
        return Some(0.3 * last.share);
    }
    if error <= GOOD || passes_more {
        return None;
    }
    let best = &rounds[choice(rounds, column)];
    let [fine, rough, open] = best.errors[column];
    if !sized && rough > FAR_TOO_LARGE && open > NOISE {
        // Of what size steps have to be is not known: far smaller ones may show nothing better yet.
        let smallest = rounds.iter().map(|round| round.share).fold(f64::INFINITY, f64::min);
        return Some(0.03 * smallest);
    }
    if before.is_some_and(|(_, before)| error > 0.5 * before) {
        // Not round-off, which larger steps make less of: kinks between the runs, which smaller ones leave outside.
        let smallest = rounds.iter().map(|round| round.share).fold(f64::INFINITY, f64::min);
        return Some(0.1 * smallest).filter(|_| open > NOISE && smallest > 0.2 * rounds[0].share);
    }
    let wanted = if rough > FAR_TOO_LARGE {
        0.03 * best.share
    } else if fine < 0.1 * rough {
        // What order 4 leaves out goes with the fourth power.
        (AIM / fine).powf(0.25).clamp(0.02, 0.7) * best.share
    } else {
        10.0 * best.share
    };
    Some(wanted).filter(|wanted| *wanted != last.share)
}

/// The values of each column.
fn columns(wanted: &Wanted, values: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let outputs = wanted.outputs.len();
    let samples = (values - wanted.figures.len()) / outputs.max(1);
    let figures = outputs * samples..values;
    (0..outputs).map(move |k| k * samples..(k + 1) * samples).chain(figures.map(|k| k..k + 1))
}

fn sampled_values(done: &Done, wanted: &Wanted) -> Vec<f64> {
    let report = &done.report;
    let outputs = wanted.outputs.iter().flat_map(|output| report.columns[*output].iter().copied());
    let figures = wanted.figures.iter().map(|figure| report.summary.figures[*figure].value.unwrap_or(f64::NAN));
    outputs.chain(figures).collect()
}

fn sampled(done: &Done, wanted: &Wanted, times: &[f64]) -> Sampled {
    let report = &done.report;
    let before = |time: f64| report.times.partition_point(|sample| *sample * done.unit_of_time < time);
    let mut events = BTreeMap::<String, Vec<(usize, &'static str)>>::new();
    for event in &report.events {
        let row = format!("{} {}", event.element, event.name_of_row());
        events.entry(row).or_default().push((before(event.time), event.kind.name()));
    }
    Sampled {
        values: sampled_values(done, wanted),
        elsewhere: report.times != times,
        samples: report.times.len(),
        events,
        switches: report.summary.recoveries[Remedy::Event],
    }
}

/// Samples that an event passes between the runs, and those before which what happened to a row differs.
fn passed(values: &[Sampled]) -> Vec<bool> {
    let samples = values[0].samples;
    let mut passed = vec![false; samples];
    let rows: BTreeSet<&String> = values.iter().flat_map(|one| one.events.keys()).collect();
    for row in rows {
        let of_row =
            |one: &'_ Sampled, number: usize| one.events.get(row).and_then(|events| events.get(number)).copied();
        for number in 0.. {
            let known: Vec<(usize, &str)> = values.iter().filter_map(|one| of_row(one, number)).collect();
            let Some(first) = known.iter().map(|event| event.0).min() else { break };
            let last = known.iter().map(|event| event.0).max().unwrap_or(first);
            let same = known.len() == values.len() && known.iter().all(|event| event.1 == known[0].1);
            let end = if same { last } else { samples };
            passed[first.min(samples)..end.min(samples)].fill(true);
            if !same {
                break;
            }
        }
    }
    passed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(events: &[(usize, &'static str)]) -> Sampled {
        let events = BTreeMap::from([("floor gap".to_owned(), events.to_vec())]);
        Sampled { values: vec![0.0; 6], elsewhere: false, samples: 6, events, switches: 0 }
    }

    #[test]
    fn a_few_values_at_which_differences_disagree_are_left_out_and_many_are_not() {
        let derivative = [1.0; 20];
        let errors = |bad: usize| (0..20).map(|k| if k < bad { 0.5 } else { 1e-9 }).collect::<Vec<f64>>();
        let count = |bad| not_smooth(&derivative, &errors(bad)).iter().filter(|rough| **rough).count();
        assert_eq!([count(0), count(1), count(2), count(3), count(20)], [0, 1, 2, 0, 0]);
    }

    #[test]
    fn samples_are_marked_where_events_pass_and_where_they_differ() {
        let marked = |runs: &[&[(usize, &'static str)]]| {
            let runs: Vec<Sampled> = runs.iter().map(|events| run(events)).collect();
            passed(&runs).iter().map(|marked| u8::from(*marked)).collect::<Vec<_>>()
        };
        assert_eq!(marked(&[&[(2, "impact")], &[(2, "impact")]]), [0; 6]);
        assert_eq!(marked(&[&[(1, "impact")], &[(3, "impact")]]), [0, 1, 1, 0, 0, 0]);
        assert_eq!(marked(&[&[(2, "impact"), (4, "impact")], &[(2, "impact")]]), [0, 0, 0, 0, 1, 1]);
        assert_eq!(marked(&[&[(1, "closes")], &[(1, "impact")]]), [0, 1, 1, 1, 1, 1]);
        assert_eq!(marked(&[&[], &[(5, "impact")]]), [0, 0, 0, 0, 0, 1]);
    }
}

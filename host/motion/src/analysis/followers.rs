//! Coordinates of a tree that follow others wherever the mechanism is: those of parallelograms, and of whatever else closes by an
//! affine relation between joint coordinates.
//!
//! An element that closes a loop is met along a whole line (plane, ...) of joint coordinates where its rows vanish on
//! q = q0 + Z u, Z the null space of their gradients at the start. Rows that are polynomials of low degree in the coordinates, and in sines
//! and cosines of angles, are met everywhere if they are at places that nothing distinguishes, near and far. Then the relation takes the
//! place of the rows: nothing is solved for, and there are no positions where the rows lose rank. Of other functions places tell nothing:
//! a hill is as good as flat but for its own width.

use odyn_graph::Expr;

use super::evaluator::Evaluator;
use super::formulation::AnalysisError;
use crate::plan::{Follower, Layout, Measure};
use crate::program::{JointEquations, Node, Sets};

/// Violation at which a row counts as met away from the start, as a share of its gradient along the bodies' coordinates times the
/// scene's length.
const MET: f64 = 1e-12;
/// Places away from the start at which rows are evaluated.
const PLACES: usize = 4;
/// How much further away each place is than the one before: rad, or lengths of the scene.
const AWAY: f64 = 0.7;
/// So many more places are farther away by this factor, where what is small nearby is not if it grows faster than evenly.
const FAR_PLACES: usize = 2;
const FAR: f64 = 1e3;
/// Largest degree of a row in a coordinate, its sine and its cosine: less than there are places.
const MOST_DEGREE: u32 = 4;
/// Share of the largest gradient below which what elimination leaves is round-off.
const DEPENDENT: f64 = 1e-9;
/// Share of the largest coefficient of a relation from which on a coordinate may be the one that follows.
const LEAST_PIVOT: f64 = 0.05;
/// Distance from a whole number at which a factor is taken for one.
const WHOLE: f64 = 1e-11;
/// Evaluations times operations beyond which no more loops are looked at.
const MOST_WORK: usize = 75_000_000;

/// sum coefficient (q_line - q0_line) = 0
type Relation = Vec<(usize, f64)>;

/// A closing element that may be met on an affine subspace.
struct Loop {
    /// Places of its rows in [`Rows::values`].
    rows: Vec<usize>,
    /// Coordinates that the rows depend on, ascending.
    lines: Vec<usize>,
    /// Solved for a coordinate each, which comes first with coefficient 1.
    relations: Vec<Relation>,
}

/// The coordinates that follow others, for equations on a tree without followers. `rows` are to be examined, with their gradients'
/// `sizes` along the bodies' coordinates; `inputs` those at the start.
///
/// # Errors
/// When an opaque element fails.
pub(super) fn followers(
    joint: &JointEquations,
    (layout, sets): (&Layout, &Sets),
    (rows, sizes): (&[usize], &[f64]),
    inputs: &[f64],
    length: f64,
) -> Result<Vec<Follower>, AnalysisError> {
    let coordinates = &joint.coordinates;
    let scale: Vec<f64> =
        coordinates.lines.iter().map(|line| if line.measure == Measure::Length { length } else { 1.0 }).collect();
    let slots: Vec<usize> = coordinates.lines.iter().map(|line| coordinates.slot_of(line.position)).collect();
    let line_of_column = |column: usize| coordinates.lines.binary_search_by_key(&column, |line| line.column).ok();
    // Rows of one element come one after the other.
    let mut loops: Vec<Loop> = Vec::new();
    let (mut values, mut slopes): (Vec<Node>, Vec<Node>) = Default::default();
    // What rows come to away from the start.
    let mut naturals = Vec::new();
    let mut entries: Vec<Vec<(usize, usize)>> = Vec::new();
    let element = |k: &usize| layout.element_of_row(rows[*k]).0;
    let numbers: Vec<usize> = (0..rows.len()).collect();
    for group in numbers.chunk_by(|a, b| element(a) == element(b)) {
        let Some(lines) = lines_of(joint, group.iter().map(|k| rows[*k]), &slots, line_of_column) else { continue };
        let own = values.len()..values.len() + group.len();
        for k in group {
            let row = &joint.rows[rows[*k]];
            values.push(row.value);
            naturals.push(sizes[*k] * length);
            entries.push(row.jacobian.iter().zip(slopes.len()..).map(|((c, _), at)| (*c, at)).collect());
            slopes.extend(row.jacobian.iter().map(|(_, slope)| *slope));
        }
        loops.push(Loop { rows: own.collect(), lines, relations: Vec::new() });
    }
    if loops.is_empty() {
        return Ok(Vec::new());
    }
    let mut gradients = Evaluator::new(&joint.graph, &slopes);
    let found = gradients.run(inputs, sets)?;
    for item in &mut loops {
        let gradient = |row: &usize| -> Vec<(usize, f64)> {
            let entry = |(column, at): &(usize, usize)| {
                let line = line_of_column(*column)?;
                Some((line, found[*at] * scale[line] / naturals[*row]))
            };
            entries[*row].iter().filter_map(entry).collect()
        };
        let matrix: Vec<Relation> = item.rows.iter().map(gradient).collect();
        item.relations = solved(matrix, &scale);
    }
    loops.retain(|item| !item.relations.is_empty() && item.relations.len() < item.lines.len());
    keep_met(&mut loops, joint, sets, (&values, &naturals), (inputs, &slots, &scale))?;
    let mut list = combined(&loops, |line| coordinates.lines[line].measure);
    for follower in &mut list {
        let others = follower.of.iter().map(|(line, factor)| factor * inputs[slots[*line]]);
        follower.offset = inputs[slots[follower.line]] - others.sum::<f64>();
    }
    list.sort_unstable_by_key(|follower| follower.line);
    Ok(list)
}

/// How a node depends on coordinates.
#[derive(Clone, Copy)]
struct Shape {
    /// Of any one of them it is a polynomial of at most this degree in it, its sine and its cosine.
    degree: u32,
    /// Whether it is a sum of multiples of angles.
    is_angle: bool,
    /// All of them are from this one to that one.
    lines: (usize, usize),
}

impl Shape {
    const CONSTANT: Self = Self { degree: 0, is_angle: true, lines: (usize::MAX, 0) };

    fn with(self, other: Self, degree: u32, is_angle: bool) -> Self {
        let ((a, b), (c, d)) = (self.lines, other.lines);
        Self { degree, is_angle, lines: (a.min(c), b.max(d)) }
    }

    fn plus(self, other: Self) -> Self {
        self.with(other, self.degree.max(other.degree), self.is_angle && other.is_angle)
    }

    fn times(self, other: Self) -> Self {
        let shared = self.lines.0.max(other.lines.0) <= self.lines.1.min(other.lines.1);
        let degree = if shared { self.degree + other.degree } else { self.degree.max(other.degree) };
        self.with(other, degree, self.is_angle && other.is_angle && self.degree.min(other.degree) == 0)
    }

    /// The shape of an expression, from those of its operands; `None` where it is more than a polynomial of low degree.
    fn of(expr: Expr, input: impl Fn(usize) -> Option<Self>, at: impl Fn(Node) -> Self) -> Option<Self> {
        let shape = match expr {
            Expr::Constant(_) => Self::CONSTANT,
            Expr::Input(slot) => input(slot as usize)?,
            Expr::Add(a, b) | Expr::Sub(a, b) => at(a).plus(at(b)),
            Expr::Neg(a) => at(a),
            Expr::Mul(a, b) => at(a).times(at(b)),
            Expr::Div(a, b) if at(b).degree == 0 => at(a),
            Expr::Sin(a) | Expr::Cos(a) if at(a).is_angle => Self { is_angle: at(a).degree == 0, ..at(a) },
            Expr::Powi(a, n) if n > 0 => {
                Self { degree: at(a).degree.saturating_mul(n.unsigned_abs()), is_angle: at(a).degree == 0, ..at(a) }
            }
            _ => return None,
        };
        (shape.degree <= MOST_DEGREE).then_some(shape)
    }
}

/// The lines that rows depend on; `None` where they depend on more, or other than by polynomials of low degree, or on no line.
fn lines_of(
    joint: &JointEquations,
    rows: impl Iterator<Item = usize>,
    slots: &[usize],
    line_of_column: impl Fn(usize) -> Option<usize>,
) -> Option<Vec<usize>> {
    let mut nodes = Vec::new();
    for row in rows {
        let row = &joint.rows[row];
        if !joint.graph.is_zero(row.time) || row.jacobian.iter().any(|(column, _)| line_of_column(*column).is_none()) {
            return None;
        }
        nodes.push(row.value);
    }
    let mut lines = Vec::new();
    let all = joint.graph.ancestors(&nodes, |_| false);
    let mut shapes: Vec<Shape> = Vec::with_capacity(all.len());
    for node in &all {
        let expr = joint.graph.expr(*node);
        if let Expr::Input(slot) = expr {
            lines.push(slots.binary_search(&(slot as usize)).ok()?);
        }
        let input = |slot| {
            let line = slots.binary_search(&slot).ok()?;
            let is_angle = joint.coordinates.lines[line].measure == Measure::Angle;
            Some(Shape { degree: 1, is_angle, lines: (line, line) })
        };
        let at = |operand| shapes[all.binary_search(&operand).unwrap_or_default()];
        shapes.push(Shape::of(expr, input, at)?);
    }
    lines.sort_unstable();
    (!lines.is_empty()).then_some(lines)
}

/// The relations that gradients in natural units stand for, each solved for one of its coordinates.
fn solved(mut matrix: Vec<Relation>, scale: &[f64]) -> Vec<Relation> {
    let limit = DEPENDENT * matrix.iter().map(size).fold(0.0, f64::max);
    let mut done: Vec<Relation> = Vec::new();
    loop {
        matrix.iter_mut().for_each(|row| row.retain(|(_, slope)| slope.abs() > limit));
        let Some(at) = (0..matrix.len()).max_by(|a, b| size(&matrix[*a]).total_cmp(&size(&matrix[*b]))) else { break };
        let row = matrix.swap_remove(at);
        let Some(row) = for_one(row) else { break };
        matrix.iter_mut().chain(&mut done).for_each(|other| take(other, &row));
        done.push(row);
    }
    for relation in &mut done {
        let own = scale[relation[0].0];
        relation.iter_mut().for_each(|(line, factor)| *factor = rounded(*factor * own / scale[*line]));
        relation.retain(|(_, factor)| factor.abs() > DEPENDENT);
    }
    done
}

fn size(relation: &Relation) -> f64 {
    relation.iter().fold(0.0_f64, |size, (_, slope)| size.max(slope.abs()))
}

/// A relation solved for one of its coordinates.
fn for_one(mut relation: Relation) -> Option<Relation> {
    let (line, slope) = relation.swap_remove(pivot(&relation)?);
    relation.iter_mut().for_each(|(_, other)| *other = rounded(*other / slope));
    relation.insert(0, (line, 1.0));
    Some(relation)
}

/// Which of the coordinates of a relation follows: of those with coefficients of the smallest size, the last.
fn pivot(relation: &Relation) -> Option<usize> {
    let largest = size(relation);
    let fit = relation.iter().enumerate().filter(|(_, (_, slope))| slope.abs() >= LEAST_PIVOT * largest);
    let least = fit.clone().fold(f64::INFINITY, |size, (_, (_, slope))| size.min(slope.abs()));
    let of_least = fit.filter(|(_, (_, slope))| slope.abs() <= (1.0 + DEPENDENT) * least);
    of_least.max_by_key(|(_, (line, _))| *line).map(|(k, _)| k)
}

/// Takes a relation off another so often that the coordinate that it is solved for drops out.
fn take(relation: &mut Relation, solved: &Relation) {
    let Some(at) = relation.iter().position(|(line, _)| *line == solved[0].0) else { return };
    let (_, factor) = relation.remove(at);
    for (line, slope) in &solved[1..] {
        match relation.iter_mut().find(|(other, _)| other == line) {
            Some((_, sum)) => *sum -= factor * slope,
            None => relation.push((*line, -factor * slope)),
        }
    }
}

fn rounded(factor: f64) -> f64 {
    if (factor - factor.round()).abs() <= WHOLE { factor.round() } else { factor }
}

/// Whether a pose that gives the others but for whole turns gives the coordinate that a relation is solved for.
fn is_determined(relation: &Relation, measure: impl Fn(usize) -> Measure) -> bool {
    let turns = |line: usize| measure(line) == Measure::Angle;
    !turns(relation[0].0) || relation[1..].iter().all(|(line, factor)| !turns(*line) || factor.fract() == 0.0)
}

/// Leaves the loops whose rows are met at places far along their relations. Loops that have no coordinate in common are looked at
/// together.
fn keep_met(
    loops: &mut Vec<Loop>,
    joint: &JointEquations,
    sets: &Sets,
    (values, naturals): (&[Node], &[f64]),
    (start, slots, scale): (&[f64], &[usize], &[f64]),
) -> Result<(), AnalysisError> {
    let mut together: Vec<(Vec<bool>, Vec<usize>)> = Vec::new();
    for (number, item) in loops.iter().enumerate() {
        let free = together.iter().position(|(taken, _)| item.lines.iter().all(|line| !taken[*line]));
        let at = free.unwrap_or_else(|| {
            together.push((vec![false; slots.len()], Vec::new()));
            together.len() - 1
        });
        item.lines.iter().for_each(|line| together[at].0[*line] = true);
        together[at].1.push(number);
    }
    let mut rows = Evaluator::new(&joint.graph, values);
    let mut work = 0;
    let mut met = vec![true; loops.len()];
    for (_, numbers) in &together {
        for place in 1..=PLACES + FAR_PLACES {
            let far = if place > PLACES { FAR } else { 1.0 };
            work += rows.program().operations();
            if work > MOST_WORK {
                numbers.iter().for_each(|number| met[*number] = false);
                continue;
            }
            let mut inputs = start.to_vec();
            for item in numbers.iter().map(|number| &loops[*number]) {
                // Anywhere, but the same at each call.
                let away = |line: usize| far * AWAY * place as f64 * (1.0 + 3.0 * line as f64 + place as f64).sin();
                for relation in &item.relations {
                    let others = relation[1..].iter().map(|(line, factor)| factor * away(*line) * scale[*line]);
                    inputs[slots[relation[0].0]] -= others.sum::<f64>();
                }
                for line in item.lines.iter().filter(|line| item.relations.iter().all(|r| r[0].0 != **line)) {
                    inputs[slots[*line]] += away(*line) * scale[*line];
                }
            }
            let found = rows.run(&inputs, sets)?;
            for number in numbers {
                met[*number] &= loops[*number].rows.iter().all(|row| found[*row].abs() <= far * MET * naturals[*row]);
            }
        }
    }
    let mut met = met.into_iter();
    loops.retain(|_| met.next().unwrap_or(false));
    Ok(())
}

/// What follows from the relations of all loops together, without offsets. Relations that would turn something by other than whole
/// multiples of what others turn by are left to the rows.
fn combined(loops: &[Loop], measure: impl Fn(usize) -> Measure) -> Vec<Follower> {
    let mut known: Vec<Relation> = Vec::new();
    for relation in loops.iter().flat_map(|item| &item.relations) {
        let mut left = relation.clone();
        known.iter().for_each(|solved| take(&mut left, solved));
        left.retain(|(_, slope)| slope.abs() > DEPENDENT);
        let Some(left) = for_one(left).filter(|left| is_determined(left, &measure)) else { continue };
        for other in &mut known {
            take(other, &left);
            other.retain(|(_, slope)| slope.abs() > DEPENDENT);
        }
        known.push(left);
    }
    if !known.iter().all(|relation| is_determined(relation, &measure)) {
        return Vec::new();
    }
    let follower = |relation: Relation| Follower {
        line: relation[0].0,
        of: relation[1..].iter().map(|(line, factor)| (*line, -factor)).collect(),
        offset: 0.0,
    };
    known.into_iter().map(follower).collect()
}

//! [`condense`]: the same numbers by fewer operations.
//!
//! While a graph is built, operations are shared where they are equal as written. Here sums and products are taken as wholes,
//! whatever the order they were written in: equal terms are collected, factors that several terms of a sum have are taken out
//! of it, pairs that several sums or several products have are computed once (the greedy heuristic of kernel extraction,
//! Brayton & McMullen 1982; for pairs Hosangadi, Fallah & Kastner 2006). Round-off changes, the numbers do not. What does not
//! save is not done.

use rustc_hash::FxHashMap;
use smallvec::{SmallVec, smallvec};

use super::graph::{Expr, Graph, Node};
use super::rewrite::Rewriting;

/// Nodes beyond which a program is left as it is: looking at it would take longer than is saved.
const LARGEST: usize = 30_000;
/// Terms of a sum, or factors of a product, beyond which its pairs are not looked at.
const MOST_TERMS: usize = 64;
/// Times that pairs are looked for in what came out; later ones find next to nothing.
const ROUNDS: usize = 2;

/// A graph with the same outputs by fewer operations, and these outputs in it; `None` where none are saved.
#[must_use]
pub fn condense(graph: &Graph, outputs: &[Node]) -> Option<(Graph, Vec<Node>)> {
    let mut best = None;
    let mut live = graph.live(outputs);
    if live.len() <= LARGEST {
        for pass in [factored, paired] {
            let (graph, outputs) =
                best.as_ref().map_or((graph, outputs), |(graph, nodes): &(Graph, Vec<Node>)| (graph, nodes));
            let (found, nodes) = pass(&Wholes::new(graph, &live, outputs), outputs);
            let found_live = found.live(&nodes);
            if found_live.len() < live.len() {
                (best, live) = (Some((found, nodes)), found_live);
            }
        }
    }
    let (mut condensed, nodes) = best?;
    condensed.requested = graph.requested;
    Some((condensed, nodes))
}

/// The parts of a whole. Nearly all wholes have few.
type Parts<T> = SmallVec<[T; 6]>;

/// What a node is part of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Additive,
    Multiplicative,
    Other,
}

/// Live nodes, and which of them are parts of larger sums and products only.
struct Wholes<'g> {
    graph: &'g Graph,
    live: &'g [Node],
    /// By node.
    kinds: Vec<Kind>,
    /// By node: whether it is inside of its only user.
    inside: Vec<bool>,
    /// By node: whether its only user is (part of) a sum.
    in_sum: Vec<bool>,
}

impl<'g> Wholes<'g> {
    /// `live` is what the outputs depend on.
    fn new(graph: &'g Graph, live: &'g [Node], outputs: &[Node]) -> Self {
        let size = live.last().map_or(0, |node| node.0 as usize + 1);
        let mut users = vec![0_u32; size];
        let (mut kinds, mut user_kind) = (vec![Kind::Other; size], vec![Kind::Other; size]);
        for node in live {
            let kind = kind(graph, *node);
            kinds[node.0 as usize] = kind;
            graph.operands(*node, |operand| {
                users[operand.0 as usize] += 1;
                user_kind[operand.0 as usize] = kind;
            });
        }
        outputs.iter().for_each(|node| users[node.0 as usize] += 2);
        let only = |node: &Node, of: Kind| users[node.0 as usize] == 1 && user_kind[node.0 as usize] == of;
        let (mut inside, mut in_sum) = (vec![false; size], vec![false; size]);
        for node in live {
            in_sum[node.0 as usize] = only(node, Kind::Additive);
            inside[node.0 as usize] = match kinds[node.0 as usize] {
                Kind::Other => false,
                own => only(node, own),
            };
        }
        Self { graph, live, kinds, inside, in_sum }
    }

    fn kind(&self, node: Node) -> Kind {
        self.kinds[node.0 as usize]
    }

    fn is_inside(&self, node: Node) -> bool {
        self.inside[node.0 as usize]
    }

    /// The terms of a sum, with their signs.
    fn terms(&self, whole: Node) -> Parts<(Node, f64)> {
        let mut list = Parts::new();
        let mut open: Parts<(Node, f64)> = smallvec![(whole, 1.0)];
        while let Some((node, sign)) = open.pop() {
            let mut add = |operand: Node, sign: f64| {
                if self.is_inside(operand) && self.kind(operand) == Kind::Additive {
                    open.push((operand, sign));
                } else {
                    list.push((operand, sign));
                }
            };
            match self.graph.expr(node) {
                Expr::Add(a, b) => {
                    add(a, sign);
                    add(b, sign);
                }
                Expr::Sub(a, b) => {
                    add(a, sign);
                    add(b, -sign);
                }
                Expr::Neg(a) => add(a, -sign),
                _ => {}
            }
        }
        list.sort_by_key(|(node, _)| *node);
        list
    }

    /// The factors of a product.
    fn factors(&self, whole: Node) -> Parts<Node> {
        let mut list = Parts::new();
        let mut open: Parts<Node> = smallvec![whole];
        while let Some(node) = open.pop() {
            if let Expr::Mul(a, b) = self.graph.expr(node) {
                for operand in [a, b] {
                    if self.is_inside(operand) && self.kind(operand) == Kind::Multiplicative {
                        open.push(operand);
                    } else {
                        list.push(operand);
                    }
                }
            }
        }
        list.sort_unstable();
        list
    }
}

fn kind(graph: &Graph, node: Node) -> Kind {
    match graph.expr(node) {
        Expr::Add(..) | Expr::Sub(..) | Expr::Neg(_) => Kind::Additive,
        Expr::Mul(..) => Kind::Multiplicative,
        _ => Kind::Other,
    }
}

/// A term of a sum: coefficient times factors.
#[derive(Debug, Clone)]
struct Term {
    coefficient: f64,
    /// Ascending.
    factors: Parts<Node>,
}

/// Equal terms collected, common factors taken out of sums.
fn factored(wholes: &Wholes<'_>, outputs: &[Node]) -> (Graph, Vec<Node>) {
    let graph = wholes.graph;
    let mut g = Graph::with_room(wholes.live.len());
    let mut rewriting = Rewriting::new(graph, &mut g, FxHashMap::default());
    for node in wholes.live {
        let made = match wholes.kind(*node) {
            Kind::Additive if wholes.is_inside(*node) => continue,
            Kind::Multiplicative if wholes.is_inside(*node) || wholes.in_sum[node.0 as usize] => continue,
            Kind::Additive => {
                let terms = wholes.terms(*node).into_iter();
                let terms = terms.map(|(term, sign)| split(&mut g, wholes, &rewriting, term, sign)).collect();
                sum_of(&mut g, terms)
            }
            Kind::Multiplicative => {
                let term = split(&mut g, wholes, &rewriting, *node, 1.0);
                product_of(&mut g, &term)
            }
            Kind::Other => rewriting.one(&mut g, *node),
        };
        rewriting.replace(*node, made);
    }
    let outputs = outputs.iter().map(|node| rewriting.known(*node)).collect();
    (g, outputs)
}

/// A term with its factors in the new graph.
fn split(g: &mut Graph, wholes: &Wholes<'_>, rewriting: &Rewriting<'_>, term: Node, sign: f64) -> Term {
    let own = wholes.kind(term) == Kind::Multiplicative && !rewriting.knows(term);
    let old = if own { wholes.factors(term) } else { smallvec![term] };
    let mut coefficient = sign;
    let mut factors = Parts::with_capacity(old.len());
    for factor in old {
        let mut factor = rewriting.known(factor);
        if let Expr::Neg(inner) = g.expr(factor) {
            coefficient = -coefficient;
            factor = inner;
        }
        match g.value(factor) {
            Some(value) => coefficient *= value,
            None => factors.push(factor),
        }
    }
    factors.sort_unstable();
    Term { coefficient, factors }
}

fn product_of(g: &mut Graph, term: &Term) -> Node {
    let mut factors = term.factors.iter();
    let Some(first) = factors.next() else { return g.constant(term.coefficient) };
    let product = factors.fold(*first, |product, factor| g.mul(product, *factor));
    let coefficient = g.constant(term.coefficient);
    g.mul(coefficient, product)
}

/// A sum, with the factors that most of its terms have taken out first.
fn sum_of(g: &mut Graph, mut terms: Vec<Term>) -> Node {
    // Equal terms come together, in their order, which round-off of their sum depends on.
    terms.sort_by(|a, b| a.factors.cmp(&b.factors));
    terms.dedup_by(|next, first| {
        let equal = next.factors == first.factors;
        if equal {
            first.coefficient += next.coefficient;
        }
        equal
    });
    terms.retain(|term| term.coefficient != 0.0);
    let mut parts: Vec<Node> = Vec::new();
    while let Some(common) = most_common(&terms) {
        let (with, without): (Vec<Term>, Vec<Term>) = terms.into_iter().partition(|term| common.divides(term));
        let rest = with.into_iter().map(|term| common.taken_from(term)).collect();
        let sum = sum_of(g, rest);
        let factor = match common {
            Common::Factor(node) => node,
            Common::Number(bits) => g.constant(f64::from_bits(bits)),
        };
        parts.push(g.mul(factor, sum));
        terms = without;
    }
    parts.extend(terms.iter().map(|term| product_of(g, term)));
    // Negative parts are subtracted; a sum of nothing but these is one negation.
    parts.sort_by_key(|part| matches!(g.expr(*part), Expr::Neg(_)));
    let zero = g.constant(0.0);
    parts.into_iter().reduce(|sum, part| g.add(sum, part)).unwrap_or(zero)
}

/// What several terms of a sum have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Common {
    Factor(Node),
    /// The size of the coefficient, by its bits.
    Number(u64),
}

impl Common {
    fn divides(self, term: &Term) -> bool {
        match self {
            Self::Factor(node) => term.factors.contains(&node),
            Self::Number(bits) => term.coefficient.abs().to_bits() == bits && !term.factors.is_empty(),
        }
    }

    fn taken_from(self, mut term: Term) -> Term {
        match self {
            Self::Factor(node) => {
                if let Some(at) = term.factors.iter().position(|factor| *factor == node) {
                    term.factors.remove(at);
                }
            }
            Self::Number(_) => term.coefficient = term.coefficient.signum(),
        }
        term
    }
}

/// What most terms have, if at least two have it; among equals what was computed first.
fn most_common(terms: &[Term]) -> Option<Common> {
    if terms.len() < 2 {
        return None;
    }
    let mut all: Vec<Common> = Vec::new();
    for term in terms {
        for (k, factor) in term.factors.iter().enumerate() {
            if k == 0 || term.factors[k - 1] != *factor {
                all.push(Common::Factor(*factor));
            }
        }
        let size = term.coefficient.abs();
        if size.is_finite() && size != 1.0 && !term.factors.is_empty() {
            all.push(Common::Number(size.to_bits()));
        }
    }
    all.sort_unstable();
    let mut most = None;
    let mut least = 1;
    for equal in all.chunk_by(|a, b| a == b) {
        if equal.len() > least {
            (most, least) = (Some(equal[0]), equal.len());
        }
    }
    most
}

/// A part of sums or products: an old node, or a pair that was made.
type Part = u32;

/// Two parts of a sum, the second with a sign against the first, or two factors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Pair {
    first: Part,
    second: Part,
    opposite: bool,
}

impl Pair {
    /// As a number below 2^96, in the same order.
    fn packed(self) -> u128 {
        u128::from(self.first) << 64 | u128::from(self.second) << 1 | u128::from(self.opposite)
    }

    fn unpacked(packed: u128) -> Self {
        Self { first: (packed >> 64) as Part, second: (packed as u64 >> 1) as Part, opposite: packed & 1 == 1 }
    }
}

/// The parts of a sum, or of a product.
type Whole = Parts<(Part, bool)>;

/// Sums, or products, of which pairs are made.
struct Pairing {
    /// Parts with signs, ascending by part, by whole.
    wholes: Vec<Whole>,
    made: Vec<Pair>,
    /// Parts below are old nodes.
    first_made: Part,
}

impl Pairing {
    /// Makes the pairs that several wholes have, the most frequent first.
    fn make(&mut self) {
        for _ in 0..ROUNDS {
            let mut found: Vec<u128> = Vec::new();
            for (number, whole) in self.wholes.iter().enumerate().filter(|(_, whole)| whole.len() <= MOST_TERMS) {
                for (k, first) in whole.iter().enumerate() {
                    for second in &whole[k + 1..] {
                        let pair = Pair { first: first.0, second: second.0, opposite: first.1 != second.1 };
                        found.push(pair.packed() << 32 | number as u128);
                    }
                }
            }
            found.sort_unstable();
            found.dedup();
            let groups = found.chunk_by(|a, b| a >> 32 == b >> 32).filter(|group| group.len() > 1);
            let mut several: Vec<(Pair, &[u128])> =
                groups.map(|group| (Pair::unpacked(group[0] >> 32), group)).collect();
            several.sort_unstable_by(|a, b| b.1.len().cmp(&a.1.len()).then(a.0.cmp(&b.0)));
            let before = self.made.len();
            for (pair, places) in several {
                // Pairs made just now may have used one of its parts up.
                let has = |number: &u32| pair_in(&self.wholes[*number as usize], pair).is_some();
                let left: Vec<u32> = places.iter().map(|one| *one as u32).filter(has).collect();
                if left.len() > 1 {
                    let part = self.first_made + self.made.len() as Part;
                    self.made.push(pair);
                    left.into_iter().for_each(|number| replace(&mut self.wholes[number as usize], pair, part));
                }
            }
            if self.made.len() == before {
                return;
            }
        }
    }
}

/// Where the parts of a pair are in a whole.
fn pair_in(whole: &[(Part, bool)], pair: Pair) -> Option<(usize, usize)> {
    for (k, first) in whole.iter().enumerate().filter(|(_, first)| first.0 == pair.first) {
        let second = whole[k + 1..].iter().position(|x| x.0 == pair.second && (x.1 != first.1) == pair.opposite);
        if let Some(second) = second {
            return Some((k, k + 1 + second));
        }
    }
    None
}

fn replace(whole: &mut Whole, pair: Pair, part: Part) {
    if let Some((first, second)) = pair_in(whole, pair) {
        let sign = whole[first].1;
        whole.remove(second);
        whole.remove(first);
        // The newest part has the largest number.
        whole.push((part, sign));
    }
}

/// Pairs that several sums or several products have, computed once.
fn paired(wholes: &Wholes<'_>, outputs: &[Node]) -> (Graph, Vec<Node>) {
    let graph = wholes.graph;
    let first_made = wholes.inside.len() as Part;
    let empty = || Pairing { wholes: Vec::new(), made: Vec::new(), first_made };
    let (mut sums, mut products) = (empty(), empty());
    // By node, of those that are wholes.
    let mut number_of = vec![0; wholes.inside.len()];
    for node in wholes.live.iter().filter(|node| !wholes.is_inside(**node)) {
        let (pairing, parts): (_, Whole) = match wholes.kind(*node) {
            Kind::Other => continue,
            Kind::Additive => {
                let terms = wholes.terms(*node).into_iter();
                (&mut sums, terms.map(|(term, sign)| (term.0, sign < 0.0)).collect())
            }
            Kind::Multiplicative => {
                (&mut products, wholes.factors(*node).into_iter().map(|factor| (factor.0, false)).collect())
            }
        };
        number_of[node.0 as usize] = pairing.wholes.len();
        pairing.wholes.push(parts);
    }
    sums.make();
    products.make();
    let mut g = Graph::with_room(wholes.live.len());
    let mut rewriting = Rewriting::new(graph, &mut g, FxHashMap::default());
    let (mut known_sums, mut known_products) = (vec![None; sums.made.len()], vec![None; products.made.len()]);
    for node in wholes.live {
        let number = number_of[node.0 as usize];
        let made = match wholes.kind(*node) {
            Kind::Other => rewriting.one(&mut g, *node),
            _ if wholes.is_inside(*node) => continue,
            Kind::Additive => {
                let mut total = g.constant(0.0);
                let of_sign = |negative: bool| sums.wholes[number].iter().filter(move |part| part.1 == negative);
                for (part, negative) in of_sign(false).chain(of_sign(true)) {
                    let part = write(&mut g, &rewriting, &sums, &mut known_sums, *part, true);
                    total = if *negative { g.sub(total, part) } else { g.add(total, part) };
                }
                total
            }
            Kind::Multiplicative => {
                let mut total = g.constant(1.0);
                for (part, _) in &products.wholes[number] {
                    let part = write(&mut g, &rewriting, &products, &mut known_products, *part, false);
                    total = g.mul(total, part);
                }
                total
            }
        };
        rewriting.replace(*node, made);
    }
    let outputs = outputs.iter().map(|node| rewriting.known(*node)).collect();
    (g, outputs)
}

/// The node of a part. Pairs are made of parts with smaller numbers.
fn write(
    g: &mut Graph,
    rewriting: &Rewriting<'_>,
    pairing: &Pairing,
    known: &mut [Option<Node>],
    part: Part,
    sum: bool,
) -> Node {
    if part < pairing.first_made {
        return rewriting.known(Node(part));
    }
    let made = (part - pairing.first_made) as usize;
    if let Some(node) = known[made] {
        return node;
    }
    let pair = pairing.made[made];
    let first = write(g, rewriting, pairing, known, pair.first, sum);
    let second = write(g, rewriting, pairing, known, pair.second, sum);
    let node = match (sum, pair.opposite) {
        (true, false) => g.add(first, second),
        (true, true) => g.sub(first, second),
        (false, _) => g.mul(first, second),
    };
    known[made] = Some(node);
    node
}

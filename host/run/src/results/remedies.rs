//! [`Remedy`]: what a run does where its plain way does not get on, by name; [`Recoveries`]: how often it did.

use std::ops::{Index, IndexMut};

use serde::ser::{Serialize, SerializeMap, Serializer};

/// A remedy. Everything that integrators, solvers and analyses do in place of their plain way is one of these, and counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// A step tried again smaller because the equations could not be solved at one of its states.
    SmallerStep,
    /// A step tried again smaller because a number of it was not finite.
    NotFinite,
    /// A step tried again smaller because Newton's method did not converge.
    NoConvergence,
    /// A step shortened to end at a sample that could not be interpolated well.
    SampleStep,
    /// An old Jacobian given up because Newton's method did not converge with it.
    FreshJacobian,
    /// A change between an explicit and an implicit method.
    MethodSwitch,
    /// A step ended where the equations switch.
    Event,
    /// Switches left to error control for a while, because too many followed each other.
    Chatter,
    /// A step tried again because something happened within it that no evaluation had seen.
    WithinStep,
    /// A step of a fixed size in which something happened that no evaluation saw.
    Missed,
    /// An evaluation for which the rank-safe engine was called in.
    RankSafe,
    /// An evaluation whose state was brought to the constraints first.
    StageProjection,
    /// An evaluation or projection next to a singular position, interpolated between places on both sides of it.
    Passage,
    /// Ranks found at a place ahead, because the start is in a singular position.
    PlaceAhead,
    /// A state refused because joint equations that followed from others contradict them there.
    Contradiction,
    /// The run ended before its end, with results up to there.
    EarlyEnd,
}

/// What is reported of a remedy.
struct Words {
    name: &'static str,
    counted: &'static str,
    meaning: &'static str,
    advice: &'static str,
}

impl Remedy {
    /// All of them, in the order in which they are reported.
    pub const ALL: [Self; 16] = [
        Self::SmallerStep,
        Self::NotFinite,
        Self::NoConvergence,
        Self::SampleStep,
        Self::FreshJacobian,
        Self::MethodSwitch,
        Self::Event,
        Self::Chatter,
        Self::WithinStep,
        Self::Missed,
        Self::RankSafe,
        Self::StageProjection,
        Self::Passage,
        Self::PlaceAhead,
        Self::Contradiction,
        Self::EarlyEnd,
    ];

    /// All remedies as a part of a page, Markdown, for the book.
    #[must_use]
    pub fn page() -> String {
        let mut page = "\n## Remedies of a run\n\nThey are counted in its report and in `summary.json`.\n".to_owned();
        for remedy in Self::ALL {
            let (name, counted) = (remedy.name(), remedy.counted());
            page.push_str(&format!("\n### {name}: {counted}\n\n{} {}\n", remedy.meaning(), remedy.advice()));
        }
        page
    }

    /// The remedy of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|remedy| remedy.name() == name)
    }

    /// Its name, in the report, in `summary.json` and for `odyn explain`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.words().name
    }

    /// What is counted, in a few words that follow a number.
    #[must_use]
    pub fn counted(self) -> &'static str {
        self.words().counted
    }

    /// What happened, and why, in sentences.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        self.words().meaning
    }

    /// What a user may do about it, if anything.
    #[must_use]
    pub fn advice(self) -> &'static str {
        self.words().advice
    }

    fn words(self) -> Words {
        match self {
            Self::SmallerStep => Words {
                name: "smaller-step",
                counted: "steps made smaller because equations could not be solved",
                meaning: "At a state within a step the equations of motion had no solution, or the step could not be brought \
                          back to the joints, so it was tried again at a fraction of its size.",
                advice: "A few are harmless. Many in one place: results have many steps there; look at what the mechanism does \
                         at that time, or give `max_step`.",
            },
            Self::NotFinite => Words {
                name: "step-not-finite",
                counted: "steps made smaller because numbers were not finite",
                meaning: "A rate or a new state was infinite or no number, as where a root is taken of what is negative, so the \
                          step was tried again at a fraction of its size.",
                advice: "An element was asked beyond the range that its equations have. A few are harmless; if the run ends \
                         there, look at the element's parameters and functions.",
            },
            Self::NoConvergence => Words {
                name: "step-without-solution",
                counted: "steps made smaller because Newton's method did not converge",
                meaning: "The equations of an implicit step were not solved in a few iterations, so it was tried again smaller.",
                advice: "Usual where stiff forces set in. Many of them: an explicit method (`--method dop853`) or \
                         `--method auto` may cost less.",
            },
            Self::SampleStep => Words {
                name: "step-to-sample",
                counted: "steps shortened to end at a sample",
                meaning: "Between the ends of a step that stability limits, or with which a motion begins that is not smooth (dry \
                          friction in a plane, from rest), results cannot be interpolated well. The step was made to end at the sample.",
                advice: "Many of them are a sign of stiffness: `--method auto` or `--method radau5` is likely to cost less.",
            },
            Self::FreshJacobian => Words {
                name: "fresh-jacobian",
                counted: "Jacobians taken anew because Newton's method did not converge",
                meaning: "An implicit method kept the derivatives of an earlier state as long as Newton's method converged with \
                          them. It did not, and they were taken anew.",
                advice: "Nothing to be done: that is how work is saved.",
            },
            Self::MethodSwitch => Words {
                name: "method-switch",
                counted: "changes of method",
                meaning: "The method `auto` changed between the explicit and the implicit method, because the other was \
                          predicted to cost less.",
                advice: "Nothing to be done. If it changes to and fro many times, try each of the two alone.",
            },
            Self::Event => Words {
                name: "event",
                counted: "steps ended where equations switch",
                meaning: "A contact, a stop, friction or a function with a kink switched from one expression to another, and a \
                          step was made to end there.",
                advice: "Nothing to be done. `--without events` leaves them to error control.",
            },
            Self::Chatter => Words {
                name: "chatter",
                counted: "times too many switches to end steps at",
                meaning: "Switches followed each other so closely that, for the length of the longest step so far, no step was \
                          made to end there and error control alone saw to them.",
                advice: "An element switches to and fro without end, as ideal friction or a relay does: give it a regularisation \
                         or a hysteresis.",
            },
            Self::WithinStep => Words {
                name: "within-step",
                counted: "steps tried again for what happened within them",
                meaning: "The error test accepted a step in which a contact came and went, a pulse passed, or an angle turned on by \
                          more than half a turn, and no evaluation had seen it. Enclosures over the step found it, and the step was \
                          tried again so that it ended before.",
                advice: "Nothing to be done: nothing was missed.",
            },
            Self::Missed => Words {
                name: "missed-within-step",
                counted: "steps of a fixed size in which something happened unseen",
                meaning: "A contact came and went, or a pulse passed, between the evaluations of a step of a fixed size, which \
                          cannot be made shorter, or a counted angle turned on by more than half a turn: results are wrong from there \
                          on.",
                advice: "Make `fixed_step` smaller, or use a method that chooses its steps: `dop853`, `auto`.",
            },
            Self::RankSafe => Words {
                name: "rank-safe",
                counted: "rank-safe solutions",
                meaning: "Joint equations came close to depending on each other. Elimination in a fixed order is not to be trusted \
                          there; all equations were factored with a choice of pivots instead.",
                advice: "Results are as good, at a higher cost. If there are many, joints that constrain less (a ball joint \
                         in place of a revolute) free the mechanism of redundant equations.",
            },
            Self::StageProjection => Words {
                name: "stage-projection",
                counted: "states within steps brought to the constraints",
                meaning: "Near a singular position, or where redundant equations would contradict each other, a state within \
                          a step was brought to the joints before it was evaluated.",
                advice: "Nothing to be done: these steps cost about twice as much.",
            },
            Self::Passage => Words {
                name: "singular-passage",
                counted: "interpolated passages next to singular positions",
                meaning: "Next to a position in which the mechanism could continue in more than one way nothing can be solved \
                          well. What was asked for was interpolated between places on both sides of it: the motion goes straight \
                          through.",
                advice: "A real mechanism might take the other way there. If that matters, add what decides it: play, a spring, \
                         another initial position.",
            },
            Self::PlaceAhead => Words {
                name: "place-ahead",
                counted: "starts in a singular position, with equations chosen where the motion goes",
                meaning: "At the start more joint equations depend on each other than elsewhere. Which of them are redundant was \
                          found at a place that the initial velocities lead to.",
                advice: "Start from another position, if the branch that the motion takes matters.",
            },
            Self::Contradiction => Words {
                name: "contradiction",
                counted: "states refused because redundant joint equations contradict the others",
                meaning: "Equations that followed from others at the start, and were left out, did not hold at the end of a step. \
                          It was tried again smaller; if they really contradict each other the run ends there.",
                advice: "Two joints or drives ask for different things: the reason of the end names them. Take one of them away.",
            },
            Self::EarlyEnd => Words {
                name: "early-end",
                counted: "ends before the end asked for",
                meaning: "The motion could not be continued. The run ended with all results up to there, and a reason.",
                advice: "The reason has a code; `odyn explain` says what to do about it.",
            },
        }
    }
}

/// How often each remedy was taken. In `summary.json`, an object with the names of all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Recoveries([u64; Remedy::ALL.len()]);

impl Recoveries {
    /// The remedies that were taken, and how often.
    pub fn taken(&self) -> impl Iterator<Item = (Remedy, u64)> + '_ {
        Remedy::ALL.into_iter().map(|remedy| (remedy, self[remedy])).filter(|(_, count)| *count > 0)
    }

    /// All counts with the names of their remedies.
    pub fn counts(&mut self) -> impl Iterator<Item = (&'static str, &mut u64)> {
        Remedy::ALL.into_iter().map(Remedy::name).zip(&mut self.0)
    }
}

impl Index<Remedy> for Recoveries {
    type Output = u64;
    fn index(&self, remedy: Remedy) -> &u64 {
        &self.0[remedy as usize]
    }
}

impl IndexMut<Remedy> for Recoveries {
    fn index_mut(&mut self, remedy: Remedy) -> &mut u64 {
        &mut self.0[remedy as usize]
    }
}

impl Serialize for Recoveries {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(Remedy::ALL.len()))?;
        for remedy in Remedy::ALL {
            map.serialize_entry(remedy.name(), &self[remedy])?;
        }
        map.end()
    }
}

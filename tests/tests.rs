//! Tests of O-DYN as a whole. Each room of the host, the contract and each library of elements has its own tests beside its
//! code; here is what only shows when they work together.
//!
//! | file | what it shows |
//! |---|---|
//! | `benchmarks.rs` | scenes agree with references, in both formulations, and with the work pinned |
//! | `motion.rs` | a motion that is written beside a table leaves no trace in it |
//! | `methods.rs` | methods of integration written outside the host run scenes; the choice of the method costs little |
//! | `checkpoints.rs` | runs that are killed and resumed give the same bytes |
//! | `contacts.rs` | contacts that strike, rest and open, against closed forms and in every way |
//! | `curves.rs` | functions through points are integrated to the tolerance, however smooth they are |
//! | `relay.rs` | memories that jump switch at the instants of closed forms, in every way, and are kept |
//! | `remembering.rs` | what elements of others count and keep at instants is that of the instant |
//! | `friction.rs` | rows that hold up to a limit: they stick and slide as closed forms say, in every way |
//! | `actuated.rs` | brakes and clutches that signals actuate: they stick and slide at the instants of closed forms, in every way |
//! | `inertia.rs` | elements with mass and flexible coordinates of their own move as bodies, finite elements and closed forms do |
//! | `inertia_contacts.rs` | the mass of such elements takes part in impacts and in what sticks |
//! | `stiffening.rs` | turning and weighing down change the stiffness of bodies that bend as closed forms say |
//! | `ropes.rs` | elements with any number of bodies: ropes that catch, in every way, and what is refused |
//! | `compressor.rs` | what the paper publishes, and what `check` and `plan` say of its example |
//! | `broken_scenes.rs` | what a user reads when a scene, a library or a motion is not as it should be |
//! | `idle.rs` | what is written in a scene and cannot act is said, and what acts is not |
//! | `piles.rs` | many bodies of which any may touch any other |
//! | `plugins.rs` | libraries built outside the workspace load and run; bad ones are refused |
//! | `stores.rs` | libraries are packed, installed, pinned, verified, removed, and loaded again when they were built again |
//! | `c_plugin.rs` | libraries in C move as the same elements in Rust do; faulty ones are refused in words |
//! | `python_elements.rs` | elements written in Python move as the same elements in Rust do, bit for bit, and are handled as libraries are |
//! | `versions.rs` | libraries of earlier and later versions of the contract run, whatever they were built with |
//! | `hostile.rs` | what may come from anywhere is refused in words: scenes, tables, equations, files of libraries |
//! | `stubborn.rs` | elements that do not come back, recurse for ever, or give what is no number |
//! | `authors.rs` | mistakes of authors that only a run shows end it, or make it suspect, with the name of the element |
//! | `opaque.rs` | elements that are called at run time move as recorded ones do |
//! | `stress.rs` | the numerical stress suite passes in its short form, and a broken bound is reported |
//! | `runs.rs` | runs that are saved and brought back give the same bytes |
//! | `singular.rs` | positions where constraints lose rank are passed, at every tolerance |
//! | `masses.rs` | what joints decide does not depend on masses; light and heavy bodies side by side move as they should |
//! | `random.rs` | what must hold of any mechanism, in hundreds of random ones; `regressions/`: those that once failed |
//! | `joint_memory.rs` | joints report values and remember; internal unknowns whose solution ends are named |
//! | `states.rs` | continuous and discrete states, memory, angles over many turns |
//! | `allocations.rs` | our elements allocate nothing when they are called |
//! | `examples.rs` | every standard element has a complete manual page, and its example runs |
//! | `verification.rs` | the scenes of the verification manual pass, and cover every element |
//! | `enclosures.rs` | nothing is stepped over: contacts, pulses, barriers, turns, contradictions |
//! | `judged.rs` | results that are not to be believed are suspect |
//! | `instants.rs` | decisions where there is little to compare with: no accelerations, times far from zero, limits of zero |
//! | `events.rs` | steps end where equations switch: less work, the same results |
//! | `digits.rs` | digits that are said to be certain are; references with more digits than doubles |
//! | `analyses.rs` | equilibria, modes and linear models: closed forms, and differences in either formulation |
//! | `frozen.rs` | modes of what moves: judged where the linear model stays the same along the motion, also in axes that turn |
//! | `orientations.rs` | Euler parameters as signals: modes, linear models, kinematics, inverse dynamics against closed forms |
//! | `closed_forms.rs` | derivatives of verification scenes are those of the closed forms that these state |
//! | `sensitivities.rs` | derivatives by numbers of scenes: closed forms, both formulations, through contacts |
//! | `unaffected.rs` | outputs and figures that a number does not change |
//! | `fits.rs` | numbers from measurements: known ones are found within their intervals, what is open is named |
//! | `import.rs` | robots of URDF and MJCF files accelerate as in MuJoCo; loops close; what is left out is said |
//! | `fed_back.rs` | what gives efforts of inverse dynamics back to scenes, by tables over time |
//! | `inverse.rs` | efforts found for a motion, given back to the scene, reproduce it |
//! | `prescribed.rs` | prescribed motions with contacts, element states and internal unknowns: closed forms, runs |
//! | `resting.rs` | equilibria that friction holds: closed forms, runs that stay |
//! | `soft_and_light.rs` | equilibria and modes where light bodies bear much, and soft directions lie beside stiff ones |
//! | `giving_way.rs` | what rests under loads over time gives way in time, and is no motion before |
//! | `feet.rs` | bodies on several feet, and contacts in a plane, turned in space |
//! | `jammed.rs` | contacts with much friction: corners, impacts without an approach, slow closings |
//! | `rough.rs` | contacts that cannot slide, where a run begins |
//! | `mechanisms.rs` | kinematics, loads on one body, shaking forces: closed forms, runs, CalculiX |
//! | `formulations.rs` | joint coordinates and those of bodies give the same results |
//! | `large.rs` | scenes of many alike parts: closed forms, each as the single one, work that grows like their number |
//! | `interleaved.rs` | models share nothing |
//! | `export.rs`, `export/` | scenes as C and as FMUs: the bits of the interpreter, the results of runs, other compilers and processors |
//! | `fmu.rs`, `fmu/` | FMUs of other tools inside scenes move machines as elements do; what they return ends runs in words |
//! | `study.rs` | studies do not depend on the number of threads |
//! | `soak.rs` | many runs in one process take no more memory than one |
//! | `limit/` | the same mechanisms by hand: the limit that run times are measured against |
//! | `speed_control.rs` | a closed loop of sensor, controller, actuator and machine |
//! | `schema.rs` | the JSON schema takes the scenes, and refuses mistakes |
//! | `book.rs` | the examples of the book run, its pages hold together, those that commands write are up to date |
//! | `workshop.rs` | new crates for elements build, pass and run; faults of elements are explained |
//! | `rooms.rs` | who may use whom in the host, and that it knows no element |
//!
//! `support.rs` has the doors to scenes and results; `fixtures.rs` builds the libraries of `fixtures/`.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod actuated;
mod allocations;
mod analyses;
mod authors;
mod axes;
mod benchmarks;
mod book;
mod bouncing;
mod broken_scenes;
mod c_plugin;
mod checkpoints;
mod clearance;
mod closed_forms;
mod compressor;
mod contacts;
mod curves;
mod digits;
mod doubts;
mod enclosures;
mod events;
mod examples;
mod export;
mod fed_back;
mod feet;
mod fits;
mod fixtures;
mod fmu;
mod formulations;
mod friction;
mod frozen;
mod gains;
mod giving_way;
mod hostile;
mod idle;
mod import;
mod inertia;
mod inertia_contacts;
mod instants;
mod interleaved;
mod inverse;
mod jammed;
mod joint_memory;
mod judged;
mod large;
mod limit;
mod margins;
mod masses;
mod mechanisms;
mod methods;
mod motion;
mod opaque;
mod orientations;
mod piles;
mod plugins;
mod prescribed;
mod python_elements;
mod random;
mod relay;
mod release;
mod release_forces;
mod release_kept;
mod remembering;
mod resting;
mod rooms;
mod ropes;
mod rough;
mod runs;
mod schema;
mod sensitivities;
mod shares;
mod singular;
mod soak;
mod soft_and_light;
mod speed_control;
mod states;
mod stiffening;
mod stores;
mod stress;
mod stubborn;
mod study;
mod support;
mod travelling;
mod turntable;
mod unaffected;
mod unknowns;
mod verification;
mod versions;
mod wheels;
mod workshop;

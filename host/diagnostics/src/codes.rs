//! The table of all codes. A code is never reused for another meaning.
//!
//! To add one: a constant, and an entry of [`TABLE`] in the order of the numbers.
//!
//! | range | room |
//! |---|---|
//! | ODY01xx | text of a scene |
//! | ODY02xx | units and quantities |
//! | ODY03xx | model |
//! | ODY04xx | plugins |
//! | ODY05xx | assembly and plan |
//! | ODY06xx | integration |
//! | ODY07xx | audit |
//! | ODY08xx | results and files |

use super::Code;

/// What `odyn explain` prints of a code.
#[derive(Clone, Copy, Debug)]
pub struct Explanation {
    /// The code.
    pub code: Code,
    /// The mistake in a few words.
    pub title: &'static str,
    /// Cause, remedy and an example.
    pub text: &'static str,
}

/// The explanation of a code; case and surrounding blanks don't matter.
pub fn explain(code: &str) -> Option<&'static Explanation> {
    let wanted = code.trim();
    TABLE.iter().find(|entry| entry.code.eq_ignore_ascii_case(wanted))
}

/// The ranges of numbers and what they are about.
const RANGES: [(&str, &str); 8] = [
    ("ODY01", "Text of a scene"),
    ("ODY02", "Units and quantities"),
    ("ODY03", "Model"),
    ("ODY04", "Plugins"),
    ("ODY05", "Assembly and plan"),
    ("ODY06", "Integration"),
    ("ODY07", "Audit"),
    ("ODY08", "Results and files"),
];

/// All explanations as one page, Markdown: the catalogue of messages of the book.
#[must_use]
pub fn page() -> String {
    let mut page = "# Messages\n\nEvery message has a code, which is never used for anything else; `odyn explain CODE` prints what is \
                    written here. This page is made by `odyn explain --markdown`.\n"
        .to_owned();
    for (range, subject) in RANGES {
        page.push_str(&format!("\n## {subject}\n"));
        for entry in TABLE.iter().filter(|entry| entry.code.starts_with(range)) {
            page.push_str(&format!("\n### {}: {}\n\n{}\n", entry.code, entry.title, entry.text));
        }
    }
    page
}

/// Not TOML.
pub const SYNTAX: Code = "ODY0101";
/// A key that has no meaning at this place.
pub const UNKNOWN_KEY: Code = "ODY0102";
/// A key or table given twice.
pub const DUPLICATE_KEY: Code = "ODY0103";
/// A key that must be there is not.
pub const MISSING_KEY: Code = "ODY0104";
/// A value of another kind than expected.
pub const WRONG_TYPE: Code = "ODY0105";
/// A list of another length than expected.
pub const WRONG_LENGTH: Code = "ODY0106";
/// Two things of the same name.
pub const DUPLICATE_NAME: Code = "ODY0107";
/// A name that cannot be used.
pub const BAD_NAME: Code = "ODY0108";
/// A word that is not one of the words possible here.
pub const UNKNOWN_WORD: Code = "ODY0109";
/// Two keys that exclude each other, or one that needs another.
pub const CONFLICTING_KEYS: Code = "ODY0110";
/// A number outside of its range.
pub const OUT_OF_RANGE: Code = "ODY0111";
/// `nan`, `inf` or a number too large to be represented.
pub const NOT_FINITE: Code = "ODY0112";
/// A vector without a direction.
pub const NO_DIRECTION: Code = "ODY0113";
/// An orientation that is not a rotation.
pub const NOT_A_ROTATION: Code = "ODY0114";
/// An orientation that had to be normalised.
pub const NORMALISED: Code = "ODY0115";
/// A `--set` that cannot be applied.
pub const BAD_OVERRIDE: Code = "ODY0116";
/// Nested too deeply.
pub const TOO_DEEP: Code = "ODY0117";
/// A scene file that cannot be read.
pub const UNREADABLE: Code = "ODY0118";
/// A stress suite that cannot be understood.
pub const BAD_SUITE: Code = "ODY0119";

/// A unit that doesn't exist.
pub const UNKNOWN_UNIT: Code = "ODY0201";
/// A unit that is written wrongly.
pub const UNIT_SYNTAX: Code = "ODY0202";
/// A quantity of another dimension than expected.
pub const DIMENSION: Code = "ODY0203";
/// Arithmetic on quantities that don't fit each other.
pub const MIXED_DIMENSIONS: Code = "ODY0204";
/// A plain number where only its unit could tell what it is.
pub const NEEDS_UNIT: Code = "ODY0205";
/// An expression that can be read in two ways.
pub const AMBIGUOUS: Code = "ODY0206";
/// An expression that is written wrongly.
pub const EXPRESSION_SYNTAX: Code = "ODY0207";
/// A name in an expression that is not a parameter.
pub const UNKNOWN_PARAMETER: Code = "ODY0208";
/// Parameters that need each other.
pub const PARAMETER_CYCLE: Code = "ODY0209";
/// An expression without a finite value.
pub const NO_VALUE: Code = "ODY0210";
/// An expression nested too deeply.
pub const EXPRESSION_TOO_DEEP: Code = "ODY0211";

/// A body name that the scene doesn't define.
pub const UNKNOWN_BODY: Code = "ODY0301";
/// An element type that no library provides.
pub const UNKNOWN_TYPE: Code = "ODY0302";
/// A short element type that several libraries provide.
pub const AMBIGUOUS_TYPE: Code = "ODY0303";
/// An element of another kind than the table it stands in.
pub const WRONG_KIND: Code = "ODY0304";
/// An element between a body and itself.
pub const SELF_JOINT: Code = "ODY0305";
/// Another number of bodies than the element connects.
pub const BODY_COUNT: Code = "ODY0306";
/// A mass that no body can have.
pub const BAD_MASS: Code = "ODY0307";
/// An inertia tensor that is not positive definite.
pub const BAD_INERTIA: Code = "ODY0308";
/// An inertia tensor that violates the triangle inequality.
pub const UNREAL_INERTIA: Code = "ODY0309";
/// A parameter that the element doesn't have.
pub const UNKNOWN_ELEMENT_PARAMETER: Code = "ODY0310";
/// A parameter of an element that must be given.
pub const MISSING_ELEMENT_PARAMETER: Code = "ODY0311";
/// A parameter of an element out of its range.
pub const ELEMENT_PARAMETER_RANGE: Code = "ODY0312";
/// A parameter that the element itself refuses.
pub const ELEMENT_REFUSES: Code = "ODY0313";
/// An element whose placement is missing or incomplete.
pub const BAD_PLACEMENT: Code = "ODY0314";
/// An output of a quantity that doesn't exist.
pub const UNKNOWN_QUANTITY: Code = "ODY0315";
/// An output of a body or element that doesn't exist.
pub const UNKNOWN_TARGET: Code = "ODY0316";
/// A component or channel that the quantity doesn't have.
pub const UNKNOWN_COMPONENT: Code = "ODY0317";
/// A figure of a channel that doesn't exist.
pub const UNKNOWN_CHANNEL: Code = "ODY0318";
/// A scene in which nothing can move or nothing is defined.
pub const NOTHING_TO_DO: Code = "ODY0319";
/// A method or engine that doesn't exist.
pub const UNKNOWN_METHOD: Code = "ODY0320";
/// A signal that depends on itself at the same instant.
pub const SIGNAL_LOOP: Code = "ODY0321";
/// An element takes the reaction of a joint that is not unique.
pub const REACTION_NOT_UNIQUE: Code = "ODY0322";
/// A curve that goes far beyond the values of its points.
pub const CURVE_LEAVES_POINTS: Code = "ODY0323";
/// A curve with a jump or a kink that a joint should follow.
pub const CURVE_NOT_SMOOTH: Code = "ODY0324";
/// Points that a library joins otherwise than asked.
pub const INTERPOLATION_IGNORED: Code = "ODY0325";

/// A plugin library that wasn't found.
pub const PLUGIN_NOT_FOUND: Code = "ODY0401";
/// A file that is not a library for this machine.
pub const NOT_A_LIBRARY: Code = "ODY0402";
/// A library without a plugin manifest.
pub const NO_MANIFEST: Code = "ODY0403";
/// A plugin for another version of the interface.
pub const ABI_VERSION: Code = "ODY0404";
/// A plugin whose types have another layout.
pub const ABI_LAYOUT: Code = "ODY0405";
/// A plugin written for other conventions.
pub const ABI_CONVENTIONS: Code = "ODY0406";
/// A plugin compiled for another processor.
pub const CPU_FEATURES: Code = "ODY0407";
/// A plugin that panicked.
pub const PLUGIN_PANICKED: Code = "ODY0408";
/// Two plugins with the same element.
pub const DUPLICATE_ELEMENT: Code = "ODY0409";
/// A plugin compiled without optimisation.
pub const DEBUG_PLUGIN: Code = "ODY0410";
/// A plugin that answered something impossible.
pub const PLUGIN_MISBEHAVED: Code = "ODY0411";
/// A call into a plugin that does not come back.
pub const PLUGIN_HANGS: Code = "ODY0412";
/// A plugin whose code ended the process.
pub const PLUGIN_CRASHED: Code = "ODY0413";
/// Libraries of this name, but none of the version asked for.
pub const PLUGIN_VERSION: Code = "ODY0420";
/// A library with another content than asked for.
pub const PLUGIN_CONTENT: Code = "ODY0421";
/// Several libraries of one name, of which the first was taken.
pub const PASSED_OVER: Code = "ODY0422";
/// A package of a library that cannot be used.
pub const BAD_PACKAGE: Code = "ODY0423";
/// A library that is installed already, or not at all.
pub const INSTALLATION: Code = "ODY0424";
/// A crate for elements that cannot be made.
pub const CANNOT_MAKE_PLUGIN: Code = "ODY0425";
/// Parameters with which an element is to be examined that it cannot take.
pub const EXAMINED_WITH: Code = "ODY0426";

/// No position satisfies all joints.
pub const CANNOT_ASSEMBLE: Code = "ODY0501";
/// Redundant joint equations contradict each other.
pub const CONFLICTING_CONSTRAINTS: Code = "ODY0502";
/// Prescribed velocities contradict the joints.
pub const INCONSISTENT_VELOCITIES: Code = "ODY0503";
/// Assembly would move bodies further than allowed.
pub const ASSEMBLY_JUMP: Code = "ODY0504";
/// Some joint equations are redundant.
pub const REDUNDANT_CONSTRAINTS: Code = "ODY0505";
/// Some reactions are not unique.
pub const REACTIONS_NOT_UNIQUE: Code = "ODY0506";
/// The motion is not determined by masses and joints.
pub const SINGULAR_MASS: Code = "ODY0507";
/// Positions are known less exactly than the tolerance asks for.
pub const FAR_FROM_ORIGIN: Code = "ODY0508";
/// See its entry in [`TABLE`].
pub const CHOSEN_VELOCITY: Code = "ODY0509";

/// The step had to become too small.
pub const STEP_TOO_SMALL: Code = "ODY0601";
/// A value became infinite or undefined.
pub const MOTION_NOT_FINITE: Code = "ODY0602";
/// The run was interrupted.
pub const INTERRUPTED: Code = "ODY0603";
/// The allowed number of steps was used up.
pub const TOO_MANY_STEPS: Code = "ODY0604";
/// The position could not be brought back to the joints.
pub const PROJECTION_FAILED: Code = "ODY0605";
/// A torque on a body that has no rotation.
pub const TORQUE_ON_PARTICLE: Code = "ODY0606";
/// Something that no evaluation of a step of a fixed size has seen.
pub const MISSED_WITHIN_STEP: Code = "ODY0607";

/// A constraint violation above the limit.
pub const AUDIT_CONSTRAINTS: Code = "ODY0701";
/// An energy error above the limit.
pub const AUDIT_ENERGY: Code = "ODY0702";
/// See its entry in [`TABLE`].
pub const AUDIT_SAMPLES: Code = "ODY0703";
/// See its entry in [`TABLE`].
pub const NOT_VERIFIED: Code = "ODY0704";
/// Loads of a body that do not balance.
pub const AUDIT_LOADS: Code = "ODY0705";

/// Results cannot be written.
pub const CANNOT_WRITE: Code = "ODY0801";
/// A table of results cannot be read.
pub const CANNOT_READ_RESULTS: Code = "ODY0802";
/// Two tables have nothing in common.
pub const NOTHING_TO_COMPARE: Code = "ODY0803";
/// A run cannot go on from where another ended.
pub const CANNOT_GO_ON: Code = "ODY0804";

const fn entry(code: Code, title: &'static str, text: &'static str) -> Explanation {
    Explanation { code, title, text }
}

/// All codes in ascending order, each with its explanation.
#[rustfmt::skip]
pub const TABLE: &[Explanation] = &[
    entry(SYNTAX, "the scene is not valid TOML", "A bracket, quote, comma or `=` is missing or too much. All such places are reported together; what they mean is checked once they are gone. Text values need quotes: write `name = \"rotor\"`, not `name = rotor`."),
    entry(UNKNOWN_KEY, "unknown key", "The key has no meaning in this table, usually because it is mistyped or stands below the wrong header. Nothing is ever ignored silently. Correct the spelling; parameters of an element belong into its `params` table: `params = { stiffness = \"20 N/mm\" }`."),
    entry(DUPLICATE_KEY, "duplicate key", "The same key or table is defined twice, so one of the two would be lost. Remove one. Several bodies are written as `[[body]]` (double brackets), each with its own keys."),
    entry(MISSING_KEY, "missing key", "The table lacks a key that has no sensible default. Add it below the header that the message points to, for example `mass = 0.04` below `[[body]]`."),
    entry(WRONG_TYPE, "wrong type of value", "The value is of another kind than expected, such as text instead of a list. The message says what is expected and what was found. Example: a position is a list of three, `position = [0, 0, \"8.5 mm\"]`."),
    entry(WRONG_LENGTH, "wrong number of entries", "A list has too few or too many entries: vectors have 3, Euler parameters 4, an inertia tensor 3 (principal) or 6 (`xx, yy, zz, xy, yz, zx`)."),
    entry(DUPLICATE_NAME, "duplicate name", "Two bodies or elements, or two outputs, figures or checks have the same name, so a reference to it would be ambiguous. Bodies and elements share one set of names. Rename one of them."),
    entry(BAD_NAME, "unusable name", "Names consist of letters A-Z and a-z, digits, `_` and `-` (outputs may also contain `.`); they are not empty, `ground` is reserved for the ground, and `t` among outputs for the time. Names of parameters appear in expressions: they start with a letter, have no `-`, and differ from functions and `pi`."),
    entry(UNKNOWN_WORD, "unknown word", "The text is not one of the words that are possible here. The message lists them or names the nearest one. Example: `take = \"peak\"`."),
    entry(CONFLICTING_KEYS, "keys that don't go together", "Two keys say the same thing in different ways (`point` and `points`, `output_step` and `output_times`), or a key needs another one (`where` needs `equals`). Keep one of them, or add the missing one."),
    entry(OUT_OF_RANGE, "number out of range", "The number has no meaning here: an end before the start, a step of zero, a negative tolerance. The message names the condition. Example: `t_end = 200` with `t_start = 0`."),
    entry(NOT_FINITE, "not a finite number", "`nan`, `inf` and numbers above 1.8e308 cannot be computed with. If no limit is meant, leave the key out."),
    entry(NO_DIRECTION, "vector without direction", "An axis must have a length to give a direction, and a second axis must not be parallel to the first. Example: `axis = [0, 0, 1]`; the length of an axis doesn't matter."),
    entry(NOT_A_ROTATION, "orientation is not a rotation", "The matrix is not orthonormal or describes a mirror image, or the Euler parameters are all zero. Columns of the matrix are the body's axes in ground, rows are listed: `matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]`."),
    entry(NORMALISED, "orientation was normalised", "Euler parameters or a matrix deviate from a rotation by more than 1e-6, more than rounding explains. They were normalised. Give more digits, or use `axis` and `angle`."),
    entry(BAD_OVERRIDE, "`--set` cannot be applied", "`--set K=V` changes a parameter (`crank.radius=9mm`), a setting (`simulation.t_end=50`), or a key of a named body or element (`rotor.mass=0.05`, `main_bearing.params.friction=0`). If a name is both, write `parameters.`, `body.`, `joint.`, `force.`, `control.`, `output.`, `figure.` or `check.` in front."),
    entry(TOO_DEEP, "nested too deeply", "Tables or keys are nested far deeper than any scene needs. Flatten them."),
    entry(UNREADABLE, "the scene file cannot be read", "The file doesn't exist, may not be read, or is not UTF-8 text. Save it as UTF-8."),
    entry(BAD_SUITE, "the stress suite cannot be understood", "A suite is a TOML file of `[[trial]]`s, each with a name of its own, a scene, and one of `bounds`, `refused` and `stopped`. What a trial is compared with (`equals`) stands before it. The comment at the head of `stress/suite.toml` tells all keys."),

    entry(UNKNOWN_UNIT, "unknown unit", "Known are m, g, t, s, min, h, N, J, W, Pa, bar, Hz, rad, deg, turn, rev, rpm, in, ft, lbm, lbf, % and 1, those of the metric system with the prefixes p n u m c d k M G T. Products are written with a blank: `N m`, not `Nm`."),
    entry(UNIT_SYNTAX, "a unit is written wrongly", "Units are products (blank, `*` or `·`), quotients (`/`) and integer powers (`^2`, `²`) of known units: `\"N m s/rad\"`, `\"kg*mm^2\"`, `\"1/s\"`. A blank behind a quotient is ambiguous: write `N/(m s)` or `N s/m`."),
    entry(DIMENSION, "wrong dimension", "The value is, say, a time where a length belongs. Plain numbers are taken in the scene's own unit; a unit in the text converts: `\"8.5 mm\"`. Torque and energy count as equal, and the angle in `N m/rad` may be left out."),
    entry(MIXED_DIMENSIONS, "quantities that cannot be combined", "Only like can be added to like: `\"crank.radius + 1 mm\"`. Functions such as `exp` need plain numbers, powers of quantities need exponents that leave whole dimensions."),
    entry(NEEDS_UNIT, "plain number among quantities", "In arithmetic a plain number has no unit, so it cannot be added to a length: write `\"crank.radius + 1 mm\"`. Likewise `sin(30)` in a scene in degrees: write `sin(30 deg)`. In a function, give the rest units, too, then the variable converts: `\"1 N * sin(phi)\"`. And `Hz` counts cycles: write `50 turn/s` for an angular velocity."),
    entry(AMBIGUOUS, "can be read in two ways", "In `\"2 N/m\"` a parameter named `m` could be meant as well as the metre. Rename the parameter, or put the quantity in parentheses: `\"(2 N)/m\"`. In a check, a name must not be an output (or the time `t`) as well as a parameter."),
    entry(EXPRESSION_SYNTAX, "the expression is incomplete", "Expressions consist of numbers, quantities, parameter names, `+ - * / ^`, parentheses, `pi`, and the functions sqrt sin cos tan asin acos atan atan2 exp ln tanh abs min max. The sign of a product may be left out in front of a parenthesis, a function, `pi` or a variable: `\"20 sin(2 pi t)\"`. Example: `\"2*(crank.radius + 1 mm)\"`."),
    entry(UNKNOWN_PARAMETER, "unknown parameter", "The name is not defined in `[parameters]` (in a check: and not an output either; in a function: nor its variable). Tables in it give dotted names: `crank.radius = \"8.5 mm\"`."),
    entry(PARAMETER_CYCLE, "parameters that need each other", "Parameters may refer to each other in any order, but not in a circle. Give one of them as a number."),
    entry(NO_VALUE, "the expression has no finite value", "A division by zero, the square root of a negative number, or an overflow."),
    entry(EXPRESSION_TOO_DEEP, "the expression is nested too deeply", "Parentheses, signs or powers are nested more than 64 deep. Split the expression with the help of `[parameters]`."),

    entry(UNKNOWN_BODY, "unknown body", "An element or output names a body that the scene doesn't define. `ground` always exists. Check the spelling; names are case-sensitive."),
    entry(UNKNOWN_TYPE, "unknown element type", "No loaded library provides this type. `odyn elements list` shows all; the scene's `[plugins] libraries` says which libraries are opened."),
    entry(AMBIGUOUS_TYPE, "several libraries provide this type", "Write the full name, `library/type`, for example `odyn-joints/revolute`."),
    entry(WRONG_KIND, "element of another kind", "Joints stand in `[[joint]]`, forces in `[[force]]`, control elements in `[[control]]`. Change the header."),
    entry(SELF_JOINT, "element between a body and itself", "The bodies of a joint or force must differ. One of the names is probably meant to be another body or `ground`."),
    entry(BODY_COUNT, "wrong number of bodies", "An element connects a fixed number of bodies, in a fixed order; `odyn elements describe TYPE` shows it. Example: `bodies = [\"block\", \"rotor\"]`."),
    entry(BAD_MASS, "mass must be positive", "A moving body needs a positive mass. Use `fixed = true` for a body that doesn't move."),
    entry(BAD_INERTIA, "inertia must not be negative", "No principal moment of inertia of a moving body may be negative, nor may all be zero. One that is zero, as that of a thin rod about its axis, is taken as 1e-12 of the largest, which changes no result within reach of a tolerance. Check the signs of the products of inertia: `xy` is the entry of the tensor, minus the integral of x*y."),
    entry(UNREAL_INERTIA, "no real body has this inertia", "Each principal moment of inertia of a real body is at most the sum of the other two. The motion is computed as written; `--strict` refuses it. Often the centre of reference is another one, or a unit is wrong."),
    entry(UNKNOWN_ELEMENT_PARAMETER, "the element has no such parameter", "`odyn elements describe TYPE` lists the parameters with units and defaults."),
    entry(MISSING_ELEMENT_PARAMETER, "the element needs a parameter", "A parameter without default must be given in `params`. `odyn elements describe TYPE` lists them."),
    entry(ELEMENT_PARAMETER_RANGE, "parameter out of its range", "The element states the range of each parameter; `odyn elements describe TYPE` shows it."),
    entry(ELEMENT_REFUSES, "the element refuses its parameters", "The parameters are each valid, but not together. The message comes from the element."),
    entry(BAD_PLACEMENT, "placement is missing or incomplete", "An element needs its frames: one global `point` and `axis` at the initial position, or `frames` in body coordinates, one per body."),
    entry(UNKNOWN_QUANTITY, "unknown output quantity", "The message lists the quantities, for example `position`, `velocity`, `reaction_force`."),
    entry(UNKNOWN_TARGET, "output of something unknown", "`of` names a body or an element of the scene."),
    entry(UNKNOWN_COMPONENT, "unknown component or channel", "Vectors have the components `x`, `y` and `z`; elements declare their own channels, which `odyn elements describe TYPE` lists."),
    entry(UNKNOWN_CHANNEL, "figure of an unknown channel", "A figure is computed from a channel that an `[[output]]` names."),
    entry(NOTHING_TO_DO, "nothing to compute", "The scene has no moving body."),
    entry(UNKNOWN_METHOD, "unknown method, engine or saving", "The message lists the known ones."),
    entry(
        SIGNAL_LOOP,
        "signal that depends on itself",
        "An element's signal depends, by way of other signals, on itself at the same instant, so there is no order in which \
         they can be computed. Put an element with a state into the loop: a sensor with a time constant, a transfer \
         function, an integrator. Loops through the motion of bodies, their accelerations and reactions are no mistake: \
         these are solved for.",
    ),
    entry(
        REACTION_NOT_UNIQUE,
        "reaction that is not unique",
        "A force element (joint friction) takes the reaction of a joint, but redundant joint equations leave it undetermined: \
         infinitely many reactions give the same motion, and the force depends on which of them is chosen. Make the joints \
         statically determinate (a spherical or cylindrical joint instead of a second revolute), or use a friction element \
         that depends on unique components only.",
    ),
    entry(CURVE_LEAVES_POINTS, "curve leaves its points", "Between two neighbouring points the curve of a parameter goes beyond both their values, by more than 1 % of the range of all values. A spline does that where points bend more than a smooth function would: through `[[0, 0], [0.4, 0], [0.42, 10], [1, 10]]` it swings from -37 to 65. Write `{ points = [...], interpolation = \"monotone\" }` (which is meant where nothing is written, except for joints), `\"linear\"` or `\"steps\"`, or give more points where the curve bends. For a smooth function that is given by enough points, a spline is the most accurate."),
    entry(CURVE_NOT_SMOOTH, "curve is not smooth enough for a joint", "A driver, cam or track is an equation that bodies must follow: where its value or slope jumps, they would need infinite forces. Curves of joints are therefore splines where nothing else is written; `\"monotone\"` is possible, too (its forces jump at the points), `\"linear\"` and `\"steps\"` are refused. Outside of its points a curve is held: where it arrives there with a speed, that jumps to zero. Let the points begin and end level, or give points for the whole run."),
    entry(INTERPOLATION_IGNORED, "points joined otherwise than asked", "The library was built with an `element-api` that joins all points by splines, and the interpolation asked for (or meant, `monotone`, where none is named) gives another curve. Build the library again, or accept its splines with `interpolation = \"spline\"`."),

    entry(PLUGIN_NOT_FOUND, "plugin library not found", "No folder of the search path holds a library of this name. Searched are `--plugin`, the scene's `[plugins] path`, the project's `.odyn/plugins`, `ODYN_PLUGIN_PATH`, the user's installed libraries and the folder of the executable. `odyn plugin add FILE` installs one; in the source tree, `cargo build` builds the standard libraries."),
    entry(NOT_A_LIBRARY, "not a library for this machine", "The file is truncated, or made for another system or processor. Build or copy it again."),
    entry(NO_MANIFEST, "not an O-DYN plugin", "The library has no manifest. A plugin exports one with `export_plugin!`."),
    entry(ABI_VERSION, "plugin of another interface version", "The library was built against another version of the plugin interface. Build it again with the `element-api` of this host."),
    entry(ABI_LAYOUT, "plugin with another layout", "Types that cross the interface have another layout in the library. Build it again with the `element-api` of this host."),
    entry(ABI_CONVENTIONS, "plugin with other conventions", "The library was written for other conventions (axes, units, order of Euler parameters, signs). Build it again with the `element-api` of this host."),
    entry(CPU_FEATURES, "processor lacks features", "The library was compiled for a newer processor than this one. Compile it without `-C target-cpu=native`."),
    entry(PLUGIN_PANICKED, "plugin panicked", "The code of the plugin failed. The message names library, element and instance; report it to the author of the plugin."),
    entry(DUPLICATE_ELEMENT, "two libraries with the same element", "Two loaded libraries provide the same full element name. Remove one from `[plugins] libraries`."),
    entry(DEBUG_PLUGIN, "plugin without optimisation", "The library is a debug build; its opaque elements are up to a hundred times slower. Build it with `--release`."),
    entry(PLUGIN_MISBEHAVED, "plugin answered something impossible", "The library returned wrong lengths, undefined numbers or no answer. Report it to the author of the plugin."),
    entry(PLUGIN_HANGS, "plugin does not come back", "A call into the library takes unusually long: an endless loop, a wait for something that does not come, or just much work. The message names library, element and function. `--watchdog SECONDS` ends the program after that time."),
    entry(PLUGIN_CRASHED, "plugin crashed", "The code of the library ended the process: an invalid access to memory, recursion without end, `abort`. Nothing can be repaired then; the message names library, element and function. Rows of results up to there are on disk. Report it to the author of the plugin."),
    entry(PLUGIN_VERSION, "no library of this version", "There are libraries of this name, but none of a version that the scene is pinned to. Install one with `odyn plugin add FILE`, or change the pin. `version = \"1.2\"` means 1.2.0 up to, but not, 2.0.0; `\"=1.2.3\"` is exact."),
    entry(PLUGIN_CONTENT, "library with another content", "The file of the library is not the one that the scene's `sha256` asks for, or not the one that was installed. Nothing of it was run. `odyn plugin verify` tells which installed files were changed; another build of the same source has another hash, too."),
    entry(PASSED_OVER, "several libraries of one name", "Different libraries answer to this name. The first place of the search order was taken: command line, scene, project, ODYN_PLUGIN_PATH, user, program. To be sure which one it is, pin it: `{ name = \"acme-wobble\", version = \"^1.2\", sha256 = \"...\" }`; `odyn plugin list --pins` prints such lines."),
    entry(BAD_PACKAGE, "package that cannot be used", "The file is not a package of a library, damaged, changed, for another machine, or holds what no package may hold (links, names that lead out of its folder, too much). Nothing of it was installed or run."),
    entry(INSTALLATION, "installed already, or not at all", "`odyn plugin add` never replaces a version by another build of it: remove the old one first. `odyn plugin remove NAME@VERSION` needs the version where several are installed, and `--project DIR` for those of a project."),
    entry(CANNOT_MAKE_PLUGIN, "no crate for elements can be made", "`odyn plugin new` writes a new folder, whose name is that of the crate and of its element: a letter a-z, then a-z, 0-9, `-` and `_`, no word that Rust or cargo use. Something of this name is never replaced. `--api` names the folder `element-api` of a copy of O-DYN's sources, or a version of it."),
    entry(EXAMINED_WITH, "an element cannot be examined like this", "`odyn plugin check` examines elements with the parameters of `--params`, written as in a scene; required ones that are not given get a value inside their range. Names and values must be those that the element describes (`odyn elements describe`), and names of elements and checks those of the library and of the test kit."),

    entry(CANNOT_ASSEMBLE, "the joints cannot be assembled", "No position near the given one satisfies all joints. The message names the joints that contradict each other, and by how much each of their rows misses where the bodies miss least (least squares); joints that are not named can be met. Change a length, a point or an axis of one of those named, or take one away."),
    entry(CONFLICTING_CONSTRAINTS, "joints contradict each other", "Some joint equations depend on others and demand something else, as in a triangle whose bars don't fit: velocities at the start that cannot all be had (two drives of one shaft), or, later, positions. The message names the joints."),
    entry(INCONSISTENT_VELOCITIES, "velocities contradict the joints", "The prescribed velocities cannot all hold. Leave those out that follow from the joints: `velocity = [\"free\", \"free\", 0]`."),
    entry(ASSEMBLY_JUMP, "assembly moved bodies too far", "The nearest assembled position is further from the given one than allowed. Correct the initial positions, or raise the limit."),
    entry(REDUNDANT_CONSTRAINTS, "redundant joint equations", "Some joint equations follow from others, which is normal for planar mechanisms with spatial joints. The motion is not affected."),
    entry(REACTIONS_NOT_UNIQUE, "reactions are not unique", "Redundant joints share a load in a way that rigid bodies don't determine. Sums over the joints are unique. Use a joint with fewer constraints, or a bushing."),
    entry(SINGULAR_MASS, "the motion is not determined", "A direction of motion has neither mass nor a joint. Give the body a mass, or fix it."),
    entry(FAR_FROM_ORIGIN, "far from the origin", "Numbers have 16 digits. A machine of 0.1 m that stands 1000 km from the origin leaves 9 of them for its motion, and errors below that cannot be had; in Cartesian coordinates the integrator takes many small steps in search of them. Put the origin near the machine, or raise the tolerance."),
    entry(
        CHOSEN_VELOCITY,
        "a velocity at the start was chosen",
        "The scene gives some velocities, the joints determine others, and what is left open is chosen: of all velocities that are \
         possible, those with the least kinetic energy (from rest, the least change in the metric of mass), as if what is given had \
         been set going by blows. A link that hangs on one whose speed is given then swings back. Where a chosen velocity is not \
         small beside those that are given, this is said: give it, too (`velocity`, `angular_velocity` of the body; zero for \
         rest), or leave it if that is what you mean. `odyn check` lists all of them.",
    ),

    entry(STEP_TOO_SMALL, "step too small", "The equations change faster than any sensible step: a stop without compliance, a discontinuous table, an unstable parameter. Results up to this time are kept. Try a stiff method, or look at the element named."),
    entry(MOTION_NOT_FINITE, "value not finite", "A position, velocity or force became infinite or undefined. Results up to this time are kept."),
    entry(INTERRUPTED, "interrupted", "The run was stopped from outside. Results up to this time are kept."),
    entry(TOO_MANY_STEPS, "too many steps", "The number of steps reached `max_steps`. Results up to this time are kept."),
    entry(PROJECTION_FAILED, "joints cannot be kept closed", "After a step the position could not be brought back to the joints, usually near a singular position, or because masses differ by so many decades that elimination loses its digits; the message names the lightest and the heaviest body then."),
    entry(
        TORQUE_ON_PARTICLE,
        "torque without inertia",
        "A body with `particle = true` has no rotation, so nothing may turn it: joints and forces must be attached at its \
         position, and may only push. Name it last in a joint that holds a point. Otherwise give the body an inertia. A thin \
         rod, with a principal moment of inertia that is zero, may turn about its axis with others, but no torque may act about \
         it alone: give it the moment that it has, however small.",
    ),

    entry(
        MISSED_WITHIN_STEP,
        "something happened unseen within a step",
        "The run reached its end, and its results are suspect: within a step of a fixed size a contact came and went, or a pulse \
         passed, between the places where the method evaluates the equations, or an angle that is counted over many turns went \
         on by more than half a turn. Enclosures over the step found it. Make `fixed_step` \
         smaller, or use a method that chooses its steps: `dop853`. The exit code is 7.",
    ),
    entry(
        AUDIT_CONSTRAINTS,
        "constraint violation above the limit",
        "The run reached its end, and its results are suspect: joints opened, or moved against their equations, by more than is \
         allowed. That is 1e-8 of the scene's size or speed with error control, 1e-3 where steps are fixed, or what `audit_tolerance` \
         (`--audit-tol`) says. Try a smaller tolerance, smaller steps or another method; the joint that is named tells where to \
         look. `--audit-tol none` switches judging off, and the summary says so. The exit code is 7.",
    ),
    entry(
        AUDIT_ENERGY,
        "energy error above the limit",
        "The run reached its end, and its results are suspect: kinetic and potential energy changed by something else than the work \
         that was done. Allowed are 1e4 times the tolerance, at least 1e-6 of the largest energy that moved, 1e-3 where steps are \
         fixed, or what `audit_tolerance` (`--audit-tol`) says. Try a smaller tolerance, smaller steps (`max_step`), another method \
         or `--verify`. An error that none of them changes comes from an element whose force is not what its `potential` and \
         `dissipation` say (`odyn plugin check`). `--audit-tol none` switches judging off, and the summary says so. The exit code is 7.",
    ),
    entry(
        AUDIT_SAMPLES,
        "energy error in the table above the limit",
        "As ODY0702, for the rows of the table: the steps keep the balance of energies, and states interpolated between their ends do \
         not. Something happens inside a step that the method has not seen: a short contact, a pulse. Limit the steps (`max_step`) \
         to less than the time that it takes.",
    ),
    entry(
        NOT_VERIFIED,
        "a second run differs",
        "`--verify` ran the scene once more, by another method, at a tenth of the tolerance and with shorter steps, and an output differs \
         by more than the tolerance explains (1e4 times the tolerance, at least 1e-6, of its size; 1e-3 where steps are fixed), or the \
         second run did not reach its end. One of the runs missed something: limit the steps (`max_step`), or lower the tolerance \
         until the difference goes. If it does not, the motion is so sensitive (chaotic) that nothing can be said of it that long, \
         or an output counts steps. The exit code is 7.",
    ),
    entry(
        AUDIT_LOADS,
        "loads of a body do not balance",
        "Where reactions or accelerations are reported, forces and torques on each body are added up, and what is left beside mass times          acceleration is held against the magnitudes of that body's own loads. It is above its limit (1e-6): solving the equations          of motion lost digits, mostly because masses or lengths differ by many decades, or a force that depends on reactions          did not converge. `--formulation` takes other coordinates, `--engine reference` another solver. The exit code is 7.",
    ),

    entry(CANNOT_WRITE, "results cannot be written", "The folder doesn't exist, may not be written, or the disk is full."),
    entry(CANNOT_READ_RESULTS, "table cannot be read", "The file is not a CSV table with one header line and numbers below."),
    entry(NOTHING_TO_COMPARE, "nothing in common", "The two tables share no times or no columns besides the time."),
    entry(
        CANNOT_GO_ON,
        "no state to go on from",
        "`--from FOLDER` goes on from the file state.toml that a run of the same scene left in its folder of results. Bodies \
         and elements must be the same, in the same order, and the scene must end later than that run did (`--t-end`). \
         `odyn resume FOLDER` goes on with the run itself, from the file checkpoint.toml that it left there \
         (`--checkpoint every=TIME`); scene, options, libraries and program must be what they were.",
    ),
];

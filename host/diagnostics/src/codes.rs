//! The table of all codes. A code is never reused for another meaning.
//!
//! To add one: an entry of the table below, in the order of the numbers. It makes the constant of that name.

use super::Exit;

/// A kind of message: what it is called for good, what the program ends with because of it, and what `odyn explain` says.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Such as `ODY0102`.
    pub code: &'static str,
    /// What the program ends with because of such an error, unless the command has a reason to end otherwise; that of a
    /// warning counts only where the command takes warnings for errors.
    pub exit: Exit,
    /// The mistake in a few words.
    pub title: &'static str,
    /// Cause, remedy and an example.
    pub text: &'static str,
}

/// Its code: `ODY0102`.
impl std::fmt::Display for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.code)
    }
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.code)
    }
}

/// Compares the code, as it is written in files and arguments.
impl PartialEq<str> for Entry {
    fn eq(&self, other: &str) -> bool {
        self.code == other
    }
}

/// The entry of a code; case and surrounding blanks don't matter.
pub fn explain(code: &str) -> Option<super::Code> {
    let wanted = code.trim();
    TABLE.iter().copied().find(|entry| entry.code.eq_ignore_ascii_case(wanted))
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

/// `NAME = code, exit, title, text;` for each makes a constant, and [`TABLE`] of all.
macro_rules! table {
    ($($name:ident = $code:literal, $exit:ident, $title:literal, $text:literal;)*) => {
        $(
            #[doc = concat!($code, ": ", $title)]
            pub const $name: super::Code = &Entry { code: $code, exit: Exit::$exit, title: $title, text: $text };
        )*

        /// All codes in ascending order.
        pub const TABLE: &[super::Code] = &[$($name),*];
    };
}

table! {
    SYNTAX = "ODY0101", Scene, "the scene is not valid TOML",
        "A bracket, quote, comma or `=` is missing or too much. All such places are reported together; what they mean is checked once they are gone. Text values need quotes: write `name = \"rotor\"`, not `name = rotor`.";
    UNKNOWN_KEY = "ODY0102", Scene, "unknown key",
        "The key has no meaning in this table, usually because it is mistyped or stands below the wrong header. Nothing is ever ignored silently. Correct the spelling; parameters of an element belong into its `params` table: `params = { stiffness = \"20 N/mm\" }`.";
    DUPLICATE_KEY = "ODY0103", Scene, "duplicate key",
        "The same key or table is defined twice, so one of the two would be lost. Remove one. Several bodies are written as `[[body]]` (double brackets), each with its own keys.";
    MISSING_KEY = "ODY0104", Scene, "missing key",
        "The table lacks a key that has no sensible default. Add it below the header that the message points to, for example `mass = 0.04` below `[[body]]`.";
    WRONG_TYPE = "ODY0105", Scene, "wrong type of value",
        "The value is of another kind than expected, such as text instead of a list. The message says what is expected and what was found. Example: a position is a list of three, `position = [0, 0, \"8.5 mm\"]`.";
    WRONG_LENGTH = "ODY0106", Scene, "wrong number of entries",
        "A list has too few or too many entries: vectors have 3, Euler parameters 4, an inertia tensor 3 (principal) or 6 (`xx, yy, zz, xy, yz, zx`).";
    DUPLICATE_NAME = "ODY0107", Scene, "duplicate name",
        "Two bodies or elements, or two outputs, figures or checks have the same name, so a reference to it would be ambiguous. Bodies and elements share one set of names. Rename one of them.";
    BAD_NAME = "ODY0108", Scene, "unusable name",
        "Names consist of letters A-Z and a-z, digits, `_` and `-` (outputs may also contain `.`); they are not empty, `ground` is reserved for the ground, and `t` among outputs for the time. Names of parameters appear in expressions: they start with a letter, have no `-`, and differ from functions and `pi`.";
    UNKNOWN_WORD = "ODY0109", Scene, "unknown word",
        "The text is not one of the words that are possible here. The message lists them or names the nearest one. Example: `take = \"peak\"`.";
    CONFLICTING_KEYS = "ODY0110", Scene, "keys that don't go together",
        "Two keys say the same thing in different ways (`point` and `points`, `output_step` and `output_times`), or a key needs another one (`where` needs `equals`). Keep one of them, or add the missing one.";
    OUT_OF_RANGE = "ODY0111", Scene, "number out of range",
        "The number has no meaning here: an end before the start, a step of zero, a negative tolerance. The message names the condition. Example: `t_end = 200` with `t_start = 0`.";
    NOT_FINITE = "ODY0112", Scene, "not a finite number",
        "`nan`, `inf` and numbers above 1.8e308 cannot be computed with. If no limit is meant, leave the key out.";
    NO_DIRECTION = "ODY0113", Scene, "vector without direction",
        "An axis must have a length to give a direction, and a second axis must not be parallel to the first. Example: `axis = [0, 0, 1]`; the length of an axis doesn't matter.";
    NOT_A_ROTATION = "ODY0114", Scene, "orientation is not a rotation",
        "The matrix is not orthonormal or describes a mirror image, or the Euler parameters are all zero. Columns of the matrix are the body's axes in ground, rows are listed: `matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]`.";
    NORMALISED = "ODY0115", Scene, "orientation was normalised",
        "Euler parameters or a matrix deviate from a rotation by more than 1e-6, more than rounding explains. They were normalised. Give more digits, or use `axis` and `angle`.";
    BAD_OVERRIDE = "ODY0116", Scene, "`--set` cannot be applied",
        "`--set K=V` changes a parameter (`crank.radius=9mm`), a setting (`simulation.t_end=50`), or a key of a named body or element (`rotor.mass=0.05`, `main_bearing.params.friction=0`). If a name is both, write `parameters.`, `body.`, `joint.`, `force.`, `control.`, `output.`, `figure.` or `check.` in front.";
    TOO_DEEP = "ODY0117", Scene, "nested too deeply",
        "Tables or keys are nested far deeper than any scene needs. Flatten them.";
    UNREADABLE = "ODY0118", Files, "the scene file cannot be read",
        "The file doesn't exist, may not be read, or is not UTF-8 text. Save it as UTF-8.";
    BAD_SUITE = "ODY0119", Scene, "the stress suite cannot be understood",
        "A suite is a TOML file of `[[trial]]`s, each with a name of its own, a scene, and one of `bounds`, `refused` and `stopped`. What a trial is compared with (`equals`) stands before it. The comment at the head of `scenes/stress/suite.toml` lists all keys.";
    BAD_TABLE_FILE = "ODY0120", Scene, "file of a curve or grid that cannot be used",
        "A parameter is given by a file, `{ file = \"motor.csv\" }`, relative to the folder of the scene. It is a table of numbers between commas, semicolons, tabs or blanks, whose first line names the columns, with a unit where the numbers are not in the scene's: `speed [rpm], torque [N m]`. A curve takes two columns (`columns = [\"speed\", \"torque\"]`), a grid three, with one line for each pair of arguments; without `columns`, the first two are a curve, and a grid has the values of y in its first line and those of x in its first column. Lines that begin with `#` are remarks. A table that a check compares with is warned of where it is not there: the run computes everything, and the check fails.";

    UNKNOWN_UNIT = "ODY0201", Scene, "unknown unit",
        "Known are m, g, t, s, min, h, N, J, W, Pa, bar, Hz, rad, deg, turn, rev, rpm, in, ft, lbm, lbf, % and 1, those of the metric system with the prefixes p n u m c d k M G T. Products are written with a blank: `N m`, not `Nm`.";
    UNIT_SYNTAX = "ODY0202", Scene, "a unit is written wrongly",
        "Units are products (blank, `*` or `·`), quotients (`/`) and integer powers (`^2`, `²`) of known units: `\"N m s/rad\"`, `\"kg*mm^2\"`, `\"1/s\"`. A blank behind a quotient is ambiguous: write `N/(m s)` or `N s/m`.";
    DIMENSION = "ODY0203", Scene, "wrong dimension",
        "The value is, say, a time where a length belongs. Plain numbers are taken in the scene's own unit; a unit in the text converts: `\"8.5 mm\"`. Torque and energy count as equal, and the angle in `N m/rad` may be left out.";
    MIXED_DIMENSIONS = "ODY0204", Scene, "quantities that cannot be combined",
        "Only like can be added to like: `\"crank.radius + 1 mm\"`. Functions such as `exp` need plain numbers, powers of quantities need exponents that leave whole dimensions.";
    NEEDS_UNIT = "ODY0205", Scene, "plain number among quantities",
        "In arithmetic a plain number has no unit, so it cannot be added to a length: write `\"crank.radius + 1 mm\"`. Likewise `sin(30)` in a scene in degrees: write `sin(30 deg)`. In a function, give the rest units, too, then the variable converts: `\"1 N * sin(phi)\"`. And `Hz` counts cycles: write `50 turn/s` for an angular velocity.";
    AMBIGUOUS = "ODY0206", Scene, "can be read in two ways",
        "In `\"2 N/m\"` a parameter named `m` could be meant as well as the metre. Rename the parameter, or put the quantity in parentheses: `\"(2 N)/m\"`. In a check, a name must not be an output (or the time `t`) as well as a parameter.";
    EXPRESSION_SYNTAX = "ODY0207", Scene, "the expression is incomplete",
        "Expressions consist of numbers, quantities, parameter names, `+ - * / ^`, parentheses, `pi`, and the functions sqrt sin cos tan asin acos atan atan2 exp ln tanh abs min max. The sign of a product may be left out in front of a parenthesis, a function, `pi` or a variable: `\"20 sin(2 pi t)\"`. Example: `\"2*(crank.radius + 1 mm)\"`.";
    UNKNOWN_PARAMETER = "ODY0208", Scene, "unknown parameter",
        "The name is not defined in `[parameters]` (in a check: and not an output either; in a function: nor its variable). Tables in it give dotted names: `crank.radius = \"8.5 mm\"`.";
    PARAMETER_CYCLE = "ODY0209", Scene, "parameters that need each other",
        "Parameters may refer to each other in any order, but not in a circle. Give one of them as a number.";
    NO_VALUE = "ODY0210", Scene, "the expression has no finite value",
        "A division by zero, the square root of a negative number, or an overflow.";
    EXPRESSION_TOO_DEEP = "ODY0211", Scene, "the expression is nested too deeply",
        "Parentheses, signs or powers are nested more than 64 deep. Split the expression with the help of `[parameters]`.";
    FIGURE_UNIT = "ODY0212", Scene, "figure in a unit that its output does not have",
        "`unit` of a `[[figure]]` is printed beside the number, which is in the unit of the output that it is taken from: nothing is converted. Leave `unit` out, or name that unit; `[units]` chooses it.";

    UNKNOWN_BODY = "ODY0301", Scene, "unknown body",
        "An element or output names a body that the scene doesn't define. `ground` always exists. Check the spelling; names are case-sensitive.";
    UNKNOWN_TYPE = "ODY0302", Scene, "unknown element type",
        "No loaded library provides this type. `odyn elements list` shows all; the scene's `[plugins] libraries` says which libraries are opened.";
    AMBIGUOUS_TYPE = "ODY0303", Scene, "several libraries provide this type",
        "Write the full name, `library/type`, for example `odyn-joints/revolute`.";
    WRONG_KIND = "ODY0304", Scene, "element of another kind",
        "Joints stand in `[[joint]]`, forces in `[[force]]`, control elements in `[[control]]`. Change the header.";
    SELF_JOINT = "ODY0305", Scene, "element between a body and itself",
        "The bodies of a joint or force must differ. One of the names is probably meant to be another body or `ground`.";
    BODY_COUNT = "ODY0306", Scene, "wrong number of bodies",
        "An element connects a fixed number of bodies, in a fixed order; `odyn elements describe TYPE` shows it. Example: `bodies = [\"block\", \"rotor\"]`.";
    BAD_MASS = "ODY0307", Scene, "mass must be positive",
        "A moving body needs a positive mass. Use `fixed = true` for a body that doesn't move.";
    BAD_INERTIA = "ODY0308", Scene, "inertia must not be negative",
        "No principal moment of inertia of a moving body may be negative, nor may all be zero. One that is zero, as that of a thin rod about its axis, is taken as 1e-12 of the largest, which changes no result within reach of a tolerance. Check the signs of the products of inertia: `xy` is the entry of the tensor, minus the integral of x*y.";
    UNREAL_INERTIA = "ODY0309", Scene, "no real body has this inertia",
        "Each principal moment of inertia of a real body is at most the sum of the other two; where it is more by what rounding to three digits explains, as of a thin plate, nothing is said. The motion is computed as written; `--strict` refuses it. Often the centre of reference is another one, or a unit is wrong.";
    UNKNOWN_ELEMENT_PARAMETER = "ODY0310", Scene, "the element has no such parameter",
        "`odyn elements describe TYPE` lists the parameters with units and defaults.";
    MISSING_ELEMENT_PARAMETER = "ODY0311", Scene, "the element needs a parameter",
        "A parameter without default must be given in `params`. `odyn elements describe TYPE` lists them.";
    ELEMENT_PARAMETER_RANGE = "ODY0312", Scene, "parameter out of its range",
        "The element states the range of each parameter; `odyn elements describe TYPE` shows it.";
    ELEMENT_REFUSES = "ODY0313", Scene, "the element refuses its parameters",
        "The parameters are each valid, but not together. The message comes from the element.";
    BAD_PLACEMENT = "ODY0314", Scene, "placement is missing or incomplete",
        "An element needs its frames: one global `point` and `axis` at the initial position, or `frames` in body coordinates, one per body.";
    UNKNOWN_QUANTITY = "ODY0315", Scene, "unknown output quantity",
        "The message lists the quantities, for example `position`, `velocity`, `reaction_force`.";
    UNKNOWN_TARGET = "ODY0316", Scene, "output of something unknown",
        "`of` names a body or an element of the scene.";
    UNKNOWN_COMPONENT = "ODY0317", Scene, "unknown component or channel",
        "Vectors have the components `x`, `y` and `z`; elements declare their own channels, which `odyn elements describe TYPE` lists.";
    UNKNOWN_CHANNEL = "ODY0318", Scene, "figure of an unknown channel",
        "A figure is computed from outputs: `channel`, `over` and `where` are names of `[[output]]`s of the scene.";
    NOTHING_TO_DO = "ODY0319", Scene, "nothing to compute",
        "The scene has no moving body.";
    UNKNOWN_METHOD = "ODY0320", Scene, "unknown method, engine or saving",
        "The message lists the known ones.";
    SIGNAL_LOOP = "ODY0321", Scene, "signal that depends on itself",
        "An element's signal depends, by way of other signals, on itself at the same instant, so there is no order in which they can be computed. Put an element with a state into the loop: a sensor with a time constant, a transfer function, an integrator. Loops through the motion of bodies, their accelerations and reactions are no mistake: these are solved for. One thing is not: what a clutch, a brake or dry friction may hold cannot follow accelerations and reactions of the same instant, since whether it holds decides on these; put a sensor with a time constant between.";
    REACTION_NOT_UNIQUE = "ODY0322", Scene, "reaction that is not unique",
        "An element (joint friction, or one that follows a signal made of a reaction) depends on a reaction that redundant joint equations leave undetermined: infinitely many reactions are in equilibrium. Where its load depends on them, infinitely many motions are possible; one is computed, other coordinates or tolerances may compute another, and the run ends as `suspect` (exit code 7; `--audit-tol none` accepts it). Where it only reports, the channel is marked as not unique and the motion is right. Contacts can do so, too, while more of them are closed than rigid bodies determine the loads of: where they slide with friction on a path that turns (`ambiguous` in `events.csv`). Make the joints statically determinate (`odyn check` lists redundant rows; a spherical or cylindrical joint instead of a second revolute), or use friction that depends on components that are unique only.";
    CURVE_LEAVES_POINTS = "ODY0323", Scene, "curve leaves its points",
        "Between two neighbouring points the curve of a parameter goes beyond both their values, by more than 1 % of the range of all values. A spline does that where points bend more than a smooth function would: through `[[0, 0], [0.4, 0], [0.42, 10], [1, 10]]` it swings from -37 to 65. Write `{ points = [...], interpolation = \"monotone\" }` (which is meant where nothing is written, except for joints), or give more points where the curve bends; where it is not the curve of a joint, `\"linear\"` and `\"steps\"` stay between the points, too. For a smooth function that is given by enough points, a spline is the most accurate.";
    CURVE_NOT_SMOOTH = "ODY0324", Scene, "curve is not smooth enough for a joint",
        "A driver, cam or track is an equation that bodies must follow: where its value or slope jumps, they would need infinite forces. Curves of joints are therefore splines where nothing else is written; `\"monotone\"` is possible, too (its forces jump at the points), `\"linear\"` and `\"steps\"` are refused. Outside of its points a curve is held: where it arrives there with a speed, that jumps to zero. Let the points begin and end level, or give points for the whole run.";
    INTERPOLATION_IGNORED = "ODY0325", Scene, "points joined otherwise than asked",
        "The library was built with an `element-api` that joins all points by splines, and the interpolation asked for (or meant, `monotone`, where none is named) gives another curve. Build the library again, or accept its splines with `interpolation = \"spline\"`.";
    UNUSED_INPUT = "ODY0326", Scene, "input that nothing takes",
        "An `[[input]]` is a signal that a program changes while the scene runs, but no element has it among its `inputs` and no output reports it, so that changing it changes nothing. Name it where it was meant: `inputs.torque = \"push\"` of a force or control element, or an output of the quantity `input`; or take it away. The same of a signal that is connected to an input of an element which does not take it with the parameters that it has: the limit of a row of `dry-friction` that is not in use.";
    BAD_MESH = "ODY0327", Scene, "mesh that cannot be read",
        "The file of a shape is missing, is neither STL (binary or text) nor OBJ, is damaged, or has no triangles. Its place is relative to the folder of the scene; `unit` says what its numbers are: `[[body.shape]]` with `kind = \"mesh\"`, `file = \"parts/rod.stl\"`, `unit = \"mm\"`.";
    IDLE_PARAMETER = "ODY0328", Scene, "parameter that changes nothing",
        "A parameter is written for an element whose equations are the same without it and with other values of it, whatever the other numbers given to it are: a `restitution` without `unilateral`, a `filter_time` without `kd`, the `gain` of a signal that is not connected. Either what it works with is missing, or it can be left out. A value that is the default is not warned of. `odyn check`, `odyn plan` and `odyn run --strict` or `--verbose` look for such parameters.";
    NOT_IN_CATALOG = "ODY0330", Scene, "no such row in the element's catalogue",
        "`params = { use = \"6204\" }` takes recommended parameters from a row of the catalogue that the element's library brings along; `odyn elements describe` shows it. What the scene gives itself wins over the row.";
    FRICTION_CREEPS = "ODY0334", Scene, "friction that creeps",
        "Contacts stuck and slid over and over, or slid for many steps, without getting further than the tolerance lets positions be off; or no set of what sticks and slides was found. Feet that are tied together by what stands on them, on springs or on legs, do so: they hardly move against each other. From then on friction is that of a viscous fluid below a speed of the size of errors of velocities (`tolerance` times the largest speed in the scene) and Coulomb's above it, and it is tried again without from time to time, and before a run stops because events at one instant have no end. What stands creeps by no more than that speed. `events.csv` says when (`creeps`). A smaller tolerance makes that speed smaller. Methods without error control do not do this.";
    ROW_MOVED_BY_VELOCITY = "ODY0335", Scene, "state of a joint that rows cannot follow",
        "A row of a joint depends on a state of the joint, and the rate of that state on velocities, on a force or reaction, or on something that jumps. The accelerations that the row asks for would contain the derivative of all that: unknown accelerations, or jumps of velocities. Pass what is measured, or what jumps, through one more state: a filter of first order before the input of the joint (a `sensor` with a time constant, a `transfer-function`), or one more state in the joint (a servo of second order has one). Positions, time and other states may be used as they are.";

    PLUGIN_NOT_FOUND = "ODY0401", Plugin, "plugin library not found",
        "No folder of the search path holds a library of this name. Searched are `--plugin`, the scene's `[plugins] path`, the project's `.odyn/plugins`, `ODYN_PLUGIN_PATH`, the user's installed libraries and the folder of the executable. `odyn plugin add FILE` installs one; in the source tree, `cargo build` builds the standard libraries.";
    NOT_A_LIBRARY = "ODY0402", Plugin, "not a library for this machine",
        "The file is truncated, or made for another system or processor. Build or copy it again.";
    NO_MANIFEST = "ODY0403", Plugin, "not an O-DYN plugin",
        "The library has no manifest. A plugin exports one with `export_plugin!`.";
    ABI_VERSION = "ODY0404", Plugin, "plugin of another interface version",
        "The library was built against another version of the plugin interface. Build it again with the `element-api` of this host.";
    ABI_LAYOUT = "ODY0405", Plugin, "plugin with another layout",
        "Types that cross the interface have another layout in the library. Build it again with the `element-api` of this host.";
    ABI_CONVENTIONS = "ODY0406", Plugin, "plugin with other conventions",
        "The library was written for other conventions (axes, units, order of Euler parameters, signs). Build it again with the `element-api` of this host.";
    CPU_FEATURES = "ODY0407", Plugin, "processor lacks features",
        "The library was compiled for a newer processor than this one. Compile it without `-C target-cpu=native`.";
    PLUGIN_PANICKED = "ODY0408", Plugin, "plugin panicked",
        "The code of the plugin failed. The message names library, element and instance; report it to the author of the plugin.";
    DUPLICATE_ELEMENT = "ODY0409", Plugin, "two libraries with the same element",
        "Two loaded libraries provide the same full element name. Remove one from `[plugins] libraries`.";
    DEBUG_PLUGIN = "ODY0410", Plugin, "plugin without optimisation",
        "The library is a debug build; its opaque elements are up to a hundred times slower. Build it with `--release`.";
    PLUGIN_MISBEHAVED = "ODY0411", Plugin, "plugin answered something impossible",
        "The library returned wrong lengths, undefined numbers or no answer. Report it to the author of the plugin.";
    PLUGIN_HANGS = "ODY0412", Plugin, "plugin does not come back",
        "A call into the library takes unusually long: an endless loop, a wait for something that does not come, or just much work. The message names library, element and function. `--watchdog SECONDS` ends the program after that time. A library behind glass is ended after 60 s in one call; one that really computes that long needs `--in-process`.";
    PLUGIN_CRASHED = "ODY0413", Plugin, "plugin crashed",
        "The code of the library ended its process: an invalid access to memory, recursion without end, `abort`, `exit`, more than 4 GB of memory; behind glass also the attempt to reach the network or another process, or to change a file. There it is a process of its own, and the run ends like any other that fails; a library that is trusted ends the whole program. The message names library, element and function. Rows of results up to there are on disk. Report it to the author of the plugin.";
    NOT_REPEATABLE = "ODY0414", Plugin, "element is no function",
        "An element that is called at run time gave different results for the same arguments: it counts its calls, draws random numbers, or reads a clock. Steps are tried, rejected and repeated, so equations must be functions; what an element remembers changes in `accept` only. `odyn plugin check` looks for it, too (`repeatability`).";
    PLUGIN_VERSION = "ODY0420", Plugin, "no library of this version",
        "There are libraries of this name, but none of a version that the scene is pinned to. Install one with `odyn plugin add FILE`, or change the pin. `version = \"1.2\"` means 1.2.0 up to, but not, 2.0.0; `\"=1.2.3\"` is exact.";
    PLUGIN_CONTENT = "ODY0421", Plugin, "library with another content",
        "The file of the library is not the one that the scene's `sha256` asks for, or not the one that was installed. Nothing of it was run. `odyn plugin verify` lists which installed files were changed; another build of the same source has another hash, too.";
    PASSED_OVER = "ODY0422", Plugin, "several libraries of one name",
        "Different libraries answer to this name. The first place of the search order was taken: command line, scene, project, ODYN_PLUGIN_PATH, user, program. To be sure which one it is, pin it: `{ name = \"acme-wobble\", version = \"^1.2\", sha256 = \"...\" }`; `odyn plugin list --pins` prints such lines.";
    BAD_PACKAGE = "ODY0423", Plugin, "package that cannot be used",
        "The file is not a package of a library, damaged, changed, for another machine, or holds what no package may hold (links, names that lead out of its folder, too much). Nothing of it was installed or run.";
    INSTALLATION = "ODY0424", Plugin, "installed already, or not at all",
        "`odyn plugin add` never replaces a version by another build of it: remove the old one first. `odyn plugin remove NAME@VERSION` needs the version where several are installed, and `--project DIR` for those of a project.";
    CANNOT_MAKE_PLUGIN = "ODY0425", Files, "no crate for elements can be made",
        "`odyn plugin new` writes a new folder, whose name is that of the crate and of its element: a letter a-z, then a-z, 0-9, `-` and `_`, no word that Rust or cargo use. Something of this name is never replaced. `--api` names the folder `element-api` of a copy of O-DYN's sources, or a version of it.";
    EXAMINED_WITH = "ODY0426", Usage, "an element cannot be examined like this",
        "`odyn plugin check` examines elements with the parameters of `--params`, written as in a scene; required ones that are not given get a value inside their range. Names and values must be those that the element describes (`odyn elements describe`), and names of elements and checks those of the library and of the test kit.";

    CANNOT_ASSEMBLE = "ODY0501", Assembly, "the joints cannot be assembled",
        "No position near the given one satisfies all joints. The message names the joints that contradict each other, and by how much each of their rows misses where the bodies miss least (least squares); joints that are not named can be met. Change a length, a point or an axis of one of those named, or take one away.";
    CONFLICTING_CONSTRAINTS = "ODY0502", Assembly, "joints contradict each other",
        "Some joint equations depend on others and demand something else, as in a triangle whose bars don't fit: velocities at the start that cannot all be had (two drives of one shaft), or, later, positions. The message names the joints.";
    INCONSISTENT_VELOCITIES = "ODY0503", Assembly, "velocities contradict the joints",
        "The prescribed velocities cannot all hold. Leave those out that follow from the joints: `velocity = [\"free\", \"free\", 0]`. Velocities that differ by what takes nothing further in the whole run than 1e-12 of the scene's size are the same.";
    ASSEMBLY_JUMP = "ODY0504", Assembly, "assembly moved bodies too far",
        "The nearest assembled position is further from the given one than a fifth of the size of the scene, or 0.2 rad. The message names the row of a joint that is missed most where the scene puts the bodies. Correct the initial positions, or that joint.";
    REDUNDANT_CONSTRAINTS = "ODY0505", Assembly, "redundant joint equations",
        "Some joint equations follow from others, which is normal for planar mechanisms with spatial joints. The motion is not affected.";
    REACTIONS_NOT_UNIQUE = "ODY0506", Assembly, "reactions are not unique",
        "Redundant joints share a load in a way that rigid bodies don't determine, and so do more contacts than hold a body: a table on four legs. Sums over the joints, or the contacts, are unique. Use a joint with fewer constraints, or a bushing; three contacts, or such with stiffness (`bump-stop`). Of contacts it is seen while a scene runs: `events.csv` says since when (`indeterminate`).";
    SINGULAR_MASS = "ODY0507", Assembly, "the motion is not determined",
        "A direction of motion has neither mass nor a joint. Give the body a mass, or fix it. Or forces that depend on accelerations or reactions have no solution together with them: friction that is too large, or a force that follows a signal made of an acceleration and cancels the inertia that it moves.";
    FAR_FROM_ORIGIN = "ODY0508", Assembly, "far from the origin",
        "Numbers have 16 digits. A machine of 0.1 m that stands 1000 km from the origin leaves 9 of them for its motion, and errors below that cannot be had; in Cartesian coordinates the integrator takes many small steps in search of them. Put the origin near the machine, or raise the tolerance.";
    CHOSEN_VELOCITY = "ODY0509", Assembly, "a velocity at the start was chosen",
        "The scene gives some velocities, the joints determine others, and what is left open is chosen: of all velocities that are possible, those with the least kinetic energy (from rest, the least change in the metric of mass), as if what is given had been set going by blows. A link that hangs on one whose speed is given then swings back. Where a chosen velocity is not small beside those that are given, this is said: give it, too (`velocity`, `angular_velocity` of the body; zero for rest), or leave it if that is what you mean. `odyn check` lists all of them.";
    NO_EQUILIBRIUM = "ODY0510", Assembly, "no equilibrium was found",
        "`odyn statics` goes from the start of a scene the way of a motion without inertia, in steps that become Newton's, and holds what it finds against the equations: loads and reactions of every body, joints, rates of element states. It was not led to a place that meets them. The message names what is missing: a body that nothing holds (a free fall has no equilibrium), a state that grows for ever (an integrator with an error at its input), loads without a balance near (a motor that drives for ever), a joint that prescribes a velocity. Hold what floats, begin elsewhere, or let a run with dampers come to rest.";
    UNSTABLE_START = "ODY0511", Assembly, "the start is an unstable equilibrium",
        "The scene has `start = \"equilibrium\"`, and small motions about the equilibrium that was found grow. A run leaves it along a path that round-off decides, at a time that the tolerance decides: what comes after that is not determined by the scene. `odyn statics` shows the equilibrium, `odyn modes --at equilibrium` what grows, and `odyn statics --all 20` looks for others. Begin nearer to the one that is meant, or give a velocity that says which way it leaves.";
    LOCKED_LOOP = "ODY0512", Assembly, "a closed loop cannot move",
        "The joints of a closed loop each leave some freedom, and none together: four hinges whose axes are not parallel, or a slider that leaves the plane of its crank. Such a loop moves only where directions fit to nine digits, and one of them may have been rounded when it was written. The message names the joint that is nearly in line, and by what angle it is off: give all these joints the same `axis`, or use joints that hold less, such as `cylindrical` and `spherical`. Of gears and couplers in a loop, the ratios must multiply to one, with their signs: one tooth too many, or three external wheels in mesh with each other, and nothing turns. Drivers, stops, joints that may be released and friction are not counted. A structure that is to stand still needs no change.";
    CROSSWISE = "ODY0513", Assembly, "an element acts about another axis than its joint",
        "Torsion springs, gears, rotary drives, stops, friction in joints and their like act on bodies, or measure how they move, about or along the z axes of their frames, which joints must keep parallel. Here a joint between the two bodies has another axis, or the joints that carry both on a third body have, or the z axes are not parallel at the start: the angle that is measured is then none that the bodies turn through, and a spring, a stop or friction may well do nothing. What pushes along z alone (`bump-stop`, an actuator along its axis) is named where all that its bodies can do is slide across. Give the element the `axis` of the joint (without one it is z of the ground), or frames whose z axes are the joint's; leave it if it is meant as a load on a guide.";
    NOT_THIS_MOTION = "ODY0520", Assembly, "the prescribed motion cannot be",
        "`odyn inverse` and `odyn kinematics` move a mechanism as a motion file, or its drivers, prescribe it. The motion must be one that the joints allow, and must determine where every body is; and the named actuators must be able to cause it. The message names what is in the way: a quantity that is no position; a body that is still free (prescribe it, too); values that the joints contradict; a dead point, where a driver does not determine the motion; a freedom that no actuator moves; a contact that the motion goes through, runs into, or would need to pull; an element with a memory that only a run can tell.";

    STEP_TOO_SMALL = "ODY0601", Integration, "step too small",
        "The equations change faster than any sensible step: a stop without compliance, a discontinuous table, an unstable parameter. Results up to this time are kept. Try a stiff method, or look at the element named.";
    MOTION_NOT_FINITE = "ODY0602", Integration, "value not finite",
        "A position, velocity or force became infinite or undefined. Results up to this time are kept.";
    INTERRUPTED = "ODY0603", Interrupted, "interrupted",
        "The run was stopped from outside. Results up to this time are kept.";
    TOO_MANY_STEPS = "ODY0604", Integration, "too many steps",
        "The number of steps reached `max_steps`. Results up to this time are kept. Where stability limits the steps (\"stiff from\" in the work of the run), `--method auto` or `radau5` takes few. Otherwise something is that fast: a spring that is stiffer than meant, a body that is lighter, an element that samples often, a friction or contact with a tiny `transition_speed` or `depth`; or the motion really is, and `max_steps` of `[simulation]` may be raised. Where half of all steps went into no time at all, something jumps there, or switches to and fro: a force that jumps with a speed (a table with `interpolation = \"steps\"`, `v / abs(v)`) has no value at rest. Let it go through zero over a finite width, or say that it is friction, which can stick: `dry-friction`, `joint-friction`, `mu` of a contact.";
    PROJECTION_FAILED = "ODY0605", Integration, "joints cannot be kept closed",
        "After a step the position could not be brought back to the joints, usually near a singular position, or because masses differ by so many decades that elimination loses its digits; the message names the lightest and the heaviest body then. A drive may ask for more than the mechanism can reach: a crank is turned beyond where a link is stretched, or a ram extends beyond full length. Speeds grow without limit before that time, and the run ends just before it, with the drive and the joint named: drive it less far, change lengths, or move it by a servo or an actuator, which may give way.";
    TORQUE_ON_PARTICLE = "ODY0606", Integration, "torque without inertia",
        "A body with `particle = true` has no rotation, so nothing may turn it: joints and forces must be attached at its position, and may only push. Name it last in a joint that holds a point. Otherwise give the body an inertia. A thin rod, with a principal moment of inertia that is zero, may turn about its axis with others, but no torque may act about it alone: give it the moment that it has. Moments below 1e-12 of the body's largest count as zero; up to about 1e-7 of it round-off of the loads turns the body about that axis, and tight tolerances take many short steps, so that no less than that is better.";
    MISSED_WITHIN_STEP = "ODY0607", Audit, "something happened unseen within a step",
        "The run reached its end, and its results are suspect: within a step of a fixed size a contact came and went, or a pulse passed, between the places where the method evaluates the equations, or an angle that is counted over many turns advanced by more than half a turn. Enclosures over the step found it. Make `fixed_step` smaller, or use a method that chooses its steps: `dop853`. The exit code is 7.";
    LEFT_OPEN = "ODY0608", Audit, "a pulse may have passed unseen",
        "Functions of time are enclosed over every step, so that no pulse passes between the places where the method evaluates the equations. Ranges of this one stay too wide to tell, however short the piece: it divides by what vanishes, or is what large numbers leave of each other. The message names the longest such stretch of time. The results are right if the function does nothing there in less than a step; otherwise limit the steps (`max_step`), or compare with `--verify`.";
    COPIES_DIFFER = "ODY0609", Integration, "copies of a body are in different places",
        "Islands that run apart each have a copy of a body that follows the time, such as a belt on its drive, with a share of its mass. At the end the copies were not in one place: somewhere the drive had no hold on the body, and each copy went its own way. Run the scene with common steps (`islands = \"together\"` in `[simulation]`), which shows where.";

    AUDIT_CONSTRAINTS = "ODY0701", Audit, "constraint violation above the limit",
        "The run reached its end, and its results are suspect: joints opened, or moved against their equations, by more than is allowed. That is 1e-8 of the scene's size or speed with error control, 1e-3 where steps are fixed, or what `audit_tolerance` (`--audit-tol`) says. Try a smaller tolerance, smaller steps or another method; the joint that is named says where to look. Where the message names a kink, a smaller step helps nothing: a function that drives bodies, or a curve that guides them, has a corner (`min`, `max`, `abs`), or points that a rope or a rod measures between have met. Velocities were turned there at once, without the impact that this would be, and from then on the motion is not that of the scene: round the corner off, or keep the points apart. `--audit-tol none` switches judging off, and the summary says so. The exit code is 7.";
    AUDIT_ENERGY = "ODY0702", Audit, "energy error above the limit",
        "The run reached its end, and its results are suspect: kinetic and potential energy changed by something else than the work that was done. Allowed are 1e4 times the tolerance, at least 1e-6 and at most 1e-2 of the largest energy that moved, 1e-3 where steps are fixed, or what `audit_tolerance` (`--audit-tol`) says. Try a smaller tolerance, smaller steps (`max_step`), another method or `--verify`. An error that none of them changes comes from an element whose force is not what its `potential` and `dissipation` say (`odyn plugin check`). `--audit-tol none` switches judging off, and the summary says so. The exit code is 7.";
    AUDIT_SAMPLES = "ODY0703", Audit, "energy error in the table above the limit",
        "As ODY0702, for the rows of the table: the steps keep the balance of energies, and states interpolated between their ends do not. Something happens inside a step that the method has not seen: a short contact, a pulse. Limit the steps (`max_step`) to less than the time that it takes.";
    NOT_VERIFIED = "ODY0704", Audit, "a second run differs",
        "`--verify` ran the scene once more, by another method, at a tenth of the tolerance and with shorter steps, and an output differs by more than the tolerance explains (1e4 times the tolerance, at least 1e-6, of its size; 1e-3 where steps are fixed), or the second run did not reach its end. One of the runs missed something: limit the steps (`max_step`), or lower the tolerance until the difference goes. If it does not, the motion is so sensitive (chaotic) that nothing can be said of it that long, or an output counts steps. The exit code is 7.";
    AUDIT_LOADS = "ODY0705", Audit, "loads of a body do not balance",
        "Where reactions or accelerations are reported, forces and torques on each body are added up, and what is left beside mass times acceleration is held against the magnitudes of that body's own loads. It is above its limit (1e-6): solving the equations of motion lost digits, mostly because masses or lengths differ by many decades, or a force that depends on reactions did not converge. `--formulation` takes other coordinates, `--engine reference` another solver. The exit code is 7.";
    NO_DIGITS = "ODY0706", Audit, "no certain digits",
        "`--digits` solved the equations of the scene once more, by power series of high order in numbers of twice the digits, and held the outputs against that. From a time on, which is reported for each output, the two have no digit in common; or the more precise computation could not continue. The motion is so sensitive (chaotic) that the round-off of doubles, or of the start itself, grows to its whole size; or it comes to a position where the equations have no solution; or it is so stiff or switches so often that power series take too many steps. A smaller tolerance moves that time; where `start` (in `summary.json`) is as large, nothing does. Before that time, results hold. It changes neither status nor exit code.";
    DIGITS_ESTIMATED = "ODY0707", Audit, "digits of doubles only",
        "`--digits` could not compute the scene with more digits than those of doubles, for the reason given: an opaque element, whose equations are called and not recorded; discrete states that elements change between steps; forces that depend on reactions or accelerations; outputs or forces that need Euler parameters or coordinates that joints do not have; a start next to a singular position. Instead the scene was computed once more in doubles, by another method, in other coordinates where there are any, and at a much smaller tolerance. What is reported is the difference of the two: an estimate, which round-off that both share escapes.";
    OUTPUT_NOT_FINITE = "ODY0708", Audit, "output is not a number",
        "The run reached its end, and the table has values that are not finite numbers: an output divides by zero, or an element reports the root or logarithm of what is negative. The motion does not depend on them. Leave the output out, or have the element give a number everywhere. `--audit-tol none` makes a warning of it. The exit code is 7.";
    ELEMENT_CHECK = "ODY0750", Audit, "element used beyond what it is made for",
        "An element's library says under which conditions it may be used, and one of them did not hold during the run, at accepted steps or samples: a bearing is loaded beyond its rating, a motor turns too fast. The words are the library's. The motion is computed as if nothing had happened, and the status of the run does not change; choose another size, or see what loads it. `summary.json` has all margins under `elements`.";
    LEFT_GRID = "ODY0751", Audit, "arguments outside of a grid or curve",
        "A parameter is given by values on a grid, or by the points of a curve, and the run asked for values outside of them, where the nearest value is held: a motor turns faster than its characteristic goes. Curves that end level, with two equal values, and those over time are not looked at. Give values for the whole range, or see why the run leaves it.";

    CANNOT_WRITE = "ODY0801", Files, "results cannot be written",
        "The folder doesn't exist, may not be written, or the disk is full.";
    CANNOT_READ_RESULTS = "ODY0802", Files, "table cannot be read",
        "The file is not a CSV table with one header line and numbers below.";
    NOTHING_TO_COMPARE = "ODY0803", Files, "nothing in common",
        "The two tables share no times or no columns besides the time.";
    CANNOT_GO_ON = "ODY0804", Scene, "no state to continue from",
        "`--from FOLDER` continues from the file state.toml that a run of the same scene left in its folder of results. Bodies, elements and inputs must be the same, in the same order (an `[[input]]` that nothing takes any more may stay), and the scene must end later than that run did (`--t-end`). `odyn resume FOLDER` continues the run itself, from the file checkpoint.toml that it left there (`--checkpoint every=TIME`); scene, options, libraries and program must be what they were.";
    NO_STUDIO = "ODY0805", Files, "studio that cannot be started",
        "`odyn studio` serves a page on the loopback address of this machine. It needs a port that is free (`--port`; any free one if left out), a folder for temporary files, and the scripts of the page: they are bundled by npm when odyn is built, unless `ODYN_DESK=off` is set or npm cannot be had. `odyn run --watch` and `odyn report` need neither.";
    CANNOT_EXPORT = "ODY0806", Scene, "scene that cannot be exported",
        "`odyn export c` and `odyn export fmu` write the equations of a scene as a program with steps of a fixed size and a fixed cost. What a run decides or iterates on the way cannot be in it: impacts and contacts, rows that hold up to a limit, memories of elements, internal unknowns, forces that depend on accelerations or reactions, opaque elements, and scenes whose equations cannot be written in coordinates of joints. The message names the element and the reason; `odyn run` computes all of these.";
    NOT_IMPORTED = "ODY0807", Files, "file that cannot be imported",
        "`odyn import` reads URDF (`<robot>`) and MJCF (`<mujoco>`) and writes a scene. The file is neither, is damaged (the message says where), contradicts itself, or is made of parts that only its own program puts together: have that program write the whole model into one file (`xacro`; `mj_saveLastXML`). Document types and entities are refused. Nothing was written.";
    BAD_ELEMENT_FILE = "ODY0830", Plugin, "file of elements that cannot be used",
        "A file `*.odyn-element` has elements as data: their descriptions and, one operation per line, their equations. Python writes them (`Rod.save(\"rod.odyn-element\")`). The file is damaged, was changed by hand into something that is none, or was written by a newer version of `odyn`; the message names the line. Write it again, or use a newer program.";
    TRACED_VALUE = "ODY0831", Plugin, "traced value used as a number",
        "The functions of an element in Python are called once, with values that stand for numbers: what they compute is recorded and later run with the numbers of each instant. Such a value has no number that `if`, `bool()`, `float()`, `math.sin()` or `range()` could look at. Write `odyn.where(x > 0, a, b)` for a choice, `odyn.sin(x)` for `math.sin(x)`, `odyn.maximum(x, y)` for `max(x, y)`. A parameter is such a value, too: one recording serves all instances.";
    BAD_PYTHON_ELEMENT = "ODY0832", Plugin, "element in Python that cannot be recorded",
        "The class says something of the element that does not fit: a name that scenes cannot use, a function that is missing or gives other rows, coordinates or channels than are declared, a value that must depend on parameters only (the start of a state, a coefficient of restitution) and depends on the motion. The message names the class and the function.";
    BAD_SERIES = "ODY0833", Files, "series that a study cannot keep",
        "`odyn study --series NAMES` keeps outputs of every run over time: outputs of the scene by their names, separated by commas, or `*` for all of them. `--every N` takes the first sample and every N-th from there, `--samples N` as many as that, spread evenly from the first to the last; both take samples of the run as they are. The message says which name the scene does not have, or which number gives no sample.";
    FIXED_PARAMETER = "ODY0840", Scene, "parameter that is fixed in an export",
        "`--parameters NAME` asks for a parameter that can be set in the exported program. The scene is recorded again with other values of it; where anything but numbers of the equations changes (the start, a table, the number of rows), or a number changes by a law that is not known, or the parameter is computed from another one, it is a number in the program. Change it by `--set` before the export; `--parameters all` takes those that can be set and lists the others with the reasons.";
    NO_VARIABLE_STEPS = "ODY0841", Scene, "tolerance that cannot be held",
        "`odyn export --tolerance X` writes a program that chooses the sizes of its steps by an estimate of their errors. Of the methods that can be exported dopri5 has such an estimate, and tolerances from 1e-13 to 0.1 are taken: shares of the sizes of what moves, in each step. Without `--tolerance` steps are of a fixed size and a constant cost.";
    STEPS_TOO_LONG = "ODY0842", Scene, "steps too long for the scene",
        "`odyn export` and `odyn hil` try steps of the size that was asked for beside twice as many of half the size, from the start of the scene, with inputs as they are there. Where the two differ by more than 1 % of the sizes of what moves, or a step fails, what the exported program computes is not to be relied on. Choose a shorter `--step` (`--substeps` of `odyn hil`), `--method rodas` for a stiff scene, or `--tolerance`, with which the sizes of steps follow from their errors.";
    BAD_FMU = "ODY0850", Plugin, "FMU that cannot be read",
        "A control element `fmu` names a file that is no zip archive, has no `modelDescription.xml`, or is damaged; the message says where (line and column of the description, or the file in the archive). Document types and entities, paths that lead out of the archive and files that grow without measure are refused. Nothing of it was run, and nothing is left on disk. Export it anew; `fmpy validate FILE` and the FMU checkers of its tool say more.";
    FMU_NOT_USABLE = "ODY0851", Plugin, "FMU that cannot be used here",
        "The FMU of a control element `fmu` is whole, but cannot be run: it is of another version of the interface than 2.0 and 3.0, it has no co-simulation, it needs the tool that made it, or it has no binary for this machine. The message says what is inside. Where its sources are inside, a compiler makes the binary (`fmpy compile FILE`); otherwise export it for this platform.";
    FMU_FAILED = "ODY0852", Integration, "FMU failed",
        "A function of an FMU returned an error, or it ended the simulation; the message names the element, the file, the function, the communication step and what the FMU logged. An FMU that discards a step is not asked again with a smaller one: choose a smaller `period`. Results up to this time are kept.";
    FMU_WITHOUT_STATE = "ODY0853", Integration, "state of an FMU cannot be saved",
        "Checkpoints, `--from`, `odyn resume` and saved runs need the state of every element. An FMU gives its own only if it says so (`canGetAndSetFMUstate` and `canSerializeFMUstate` in its description) and does. Run the scene in one piece, or export the FMU with these capabilities.";
    NO_HIL = "ODY0854", Scene, "scene that cannot be run in real time",
        "`odyn hil` takes steps of a fixed size at the times of a clock. It needs a port or a name for shared memory that is free, a rate whose period is a whole number of steps, and inputs and outputs that the scene has. The message says which of these is missing.";
    HIL_ENDED = "ODY0855", Integration, "real-time run ended early",
        "A step of `odyn hil` could not be computed: the method did not converge, a value was not finite, an element failed. The report has the time and what was measured up to there.";
    NO_LATER_SAMPLE = "ODY0860", Scene, "no results after the start",
        "Results are written at the start and then every `output_step`; a step longer than the run leaves the row at the start alone, and figures such as `final` and `max` are those of the start. The run itself is computed up to its end. Give a shorter `output_step`, or the times that are wanted as `output_times`.";
    FAR_FROM_TIME_ZERO = "ODY0861", Assembly, "far from t = 0",
        "Numbers have 16 digits. A run of 3 s that begins at t = 1e9 s has times that are 1e-7 s apart: events and samples are no better known, and smaller steps are not possible. Let times count from the start of the run, `t - 1e9` in functions of time, or raise the tolerance.";
    OTHER_STEP = "ODY0862", Integration, "steps shorter than the fixed one",
        "Steps of a fixed size are equal and end with the run, at each checkpoint, and wherever an element samples: where `fixed_step` is no whole part of that time, one step more is taken, and all up to there are shorter. Give a step that fits if the size itself matters, as for comparisons with other programs.";
    OTHER_UNIT = "ODY0870", Scene, "number that looks like one of another unit",
        "Plain numbers are in the units of the scene, those of `[units]`, or SI with angles in rad. `angle = 30` is 30 rad then, nearly five turns, and `gravity = [0, 0, -9.81]` with `length = \"mm\"` is 9.81 mm/s^2, a thousandth of that on earth. The number is used as it is written. Write the unit beside it, `\"30 deg\"`, `\"-9.81 m/s^2\"`, or name it in `[units]`.";
    KEY_WITHOUT_EFFECT = "ODY0871", Scene, "key without effect",
        "Two keys are each valid, but beside one of them the other changes nothing: `fixed_step` leaves nothing to `max_step` and `first_step`, and the reference engine has coordinates of its own, whatever `formulation` says. Leave one of them out.";
    UNUSED_CONTROL = "ODY0872", Scene, "control element that nothing takes",
        "A control element makes signals, and acts on nothing by itself: what an actuator, a driver or another control element takes stands among the `inputs` of that one, `inputs.signal = \"pid.output\"`. No element and no output takes a signal of this one, so that leaving it out changes nothing. Connect it, or take it away.";
    FORCE_OF_NOTHING = "ODY0873", Scene, "force that is zero",
        "What a force element does to its bodies follows from its parameters and signals. Those of this one make forces and torques that are zero in every motion: an actuator without a law and without a signal, a spring whose coefficients are zero. Leaving it out changes nothing. Give it its law, or take it away; an element with an output of its own is not warned of, since it measures something.";
    WEIGHTLESS = "ODY0874", Scene, "mass without weight",
        "The element brings mass of its own, whose weight comes from its own parameter `gravity`: the `gravity` of `[simulation]` acts on bodies only. It was left out here and is zero, in a scene that has gravity, so that this mass is slow to move and weighs nothing. Give the element the gravity of the scene, or `gravity = [0, 0, 0]` if that is meant (a mass of water that moves along).";
    LOOSE_BODY = "ODY0875", Scene, "body that nothing holds",
        "No joint and no force element is attached to this body, while others are connected: it falls by itself. Most often a joint is missing, is disabled, or names another body. Attach the body, take it away, or leave it if it is to fall.";
    NOTHING_MOVED = "ODY0876", Audit, "nothing moved",
        "The run reached its end, and in all its time no body moved, though the joints leave freedoms: no load acts along them. Most often gravity is missing, or at right angles to what may move; an axis is not the one that was meant (without `axis` it is z of the ground); a drive has no law; or the scene begins in an equilibrium, as a pendulum that stands on its head. The results are what the scene says. It changes neither status nor exit code.";
    UNUSED_PARAMETER = "ODY0877", Scene, "parameter that nothing uses",
        "Parameters are named quantities, which act where an expression has their name: `\"crank.radius\"`, `\"2 * crank.radius\"`. No text of the scene has this one's, so that changing it, or a study over it, changes nothing. Most often a number stands where the name was meant, or the name is written otherwise. Write it where it is meant, or take it away.";
    CURVE_BESIDE_RUN = "ODY0878", Scene, "curve over time that does not fit the run",
        "A curve over time and the run do not fit each other. Either the run uses less than 1 % of the curve: its times are in another unit most probably, in ms where the scene has s; name it in the head of the column, `t [ms]`. Or the curve of a force ends more than 5 % of the run before that does, on its way from one value to another, and what it had there last acts to the end. Give points for the whole run, end it sooner, or let the curve end with two equal values, which says that it is to be held. What ends at zero, and curves of up to three points, are passed over; for joints see ODY0324.";
    CURVE_PASSED = "ODY0883", Audit, "end of a joint's curve passed",
        "The curve of a joint is held beyond its first and last point. Where it arrives there with a slope it has a kink, at which the velocity of the body that follows it is turned at once, without the impact that this would be: from then on the motion is not that of the scene. Give points beyond the motion, or let the curve end level: two equal values.";
}

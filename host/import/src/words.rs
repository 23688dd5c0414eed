//! The words of both formats: what is read of them, and what the others are about. What a file has beside them is misspelt, or of a
//! version that is not known here.
//!
//! One table a format. (wiki.ros.org/urdf/XML; mujoco.readthedocs.io, XML reference, whose program of version 4 prints the same by
//! `mj_printSchema`.)

use std::collections::HashMap;
use std::ops::Range;

use odyn_diagnostics::{Diagnostic, codes, suggest};
use roxmltree::Node;

use crate::include::Whole;
use crate::xml::{children, head};

/// What a word is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum About {
    /// It is read, is reported where that is done, or changes nothing.
    Settled,
    Mechanics,
    Contacts,
    Solver,
    Looks,
    Others,
}
use About::{Contacts, Looks, Mechanics, Others, Settled, Solver};

/// Kinds of words that are listed by what they are about, and how.
const LISTED: [(About, &str); 5] = [
    (Mechanics, "mechanics that is not read"),
    (Contacts, "how bodies would touch each other"),
    (Solver, "how MuJoCo softens and solves its equations"),
    (Looks, "looks"),
    (Others, "for other programs"),
];

/// Elements with the same words.
struct Element {
    /// The elements that they stand in; [`ANYWHERE`] are all.
    inside: &'static [&'static str],
    names: &'static [&'static str],
    words: Words,
}

enum Words {
    /// Attributes by what they are about.
    Attributes(&'static [(About, &'static str)]),
    /// Nothing in the element is looked at.
    Closed(About),
}
use Words::{Attributes, Closed};

/// Most of what is not known that is listed one by one.
const MOST: usize = 40;
/// Most words that are listed by what they are about: more than the tables have.
const MOST_BESIDE: usize = 300;
/// Characters of a value that are shown.
const SHOWN: usize = 40;
const ANYWHERE: &[&str] = &["*"];

const PLACE: (About, &str) = (Settled, "pos quat axisangle xyaxes zaxis euler");
const IN_BODIES: &[&str] = &["worldbody", "body", "frame"];
const IN_BODIES_AND_CLASSES: &[&str] = &["worldbody", "body", "frame", "default"];

/// Kinds of motors, which have their defaults in common.
pub(crate) const MOTORS: &[&str] = &[
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "orientation",
    "pid",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "plugin",
];

const fn element(
    inside: &'static [&'static str],
    names: &'static [&'static str],
    words: &'static [(About, &'static str)],
) -> Element {
    Element { inside, names, words: Attributes(words) }
}

const fn closed(about: About, inside: &'static [&'static str], names: &'static [&'static str]) -> Element {
    Element { inside, names, words: Closed(about) }
}

const URDF: &[Element] = &[
    element(&[""], &["robot"], &[(Settled, "name"), (Others, "version")]),
    closed(Settled, &["robot"], &["transmission", "gazebo", "mujoco", "drake", "sensor"]),
    element(&["robot"], &["link"], &[(Settled, "name"), (Others, "type")]),
    element(&["link"], &["inertial"], &[]),
    element(&["link"], &["visual", "collision"], &[(Settled, "name"), (Others, "group")]),
    closed(Contacts, &["link", "collision"], &["contact", "self_collision_checking", "verbose"]),
    element(&["inertial", "visual", "collision", "joint"], &["origin"], &[(Settled, "xyz rpy")]),
    element(&["inertial"], &["mass"], &[(Settled, "value")]),
    element(&["inertial"], &["inertia"], &[(Settled, "ixx ixy ixz iyy iyz izz")]),
    element(&["visual", "collision"], &["geometry"], &[]),
    element(&["geometry"], &["box"], &[(Settled, "size")]),
    element(&["geometry"], &["sphere"], &[(Settled, "radius")]),
    element(&["geometry"], &["cylinder", "capsule"], &[(Settled, "radius length")]),
    element(&["geometry"], &["mesh"], &[(Settled, "filename scale")]),
    element(&["robot", "visual", "collision"], &["material"], &[(Settled, "name")]),
    element(&["material"], &["color"], &[(Settled, "rgba")]),
    closed(Looks, &["material"], &["texture"]),
    element(&["robot"], &["joint"], &[(Settled, "name type")]),
    element(&["joint"], &["parent", "child"], &[(Settled, "link")]),
    element(&["joint"], &["axis"], &[(Settled, "xyz")]),
    element(&["joint"], &["dynamics"], &[(Settled, "damping friction")]),
    element(
        &["joint"],
        &["limit"],
        &[(Settled, "lower upper effort velocity"), (Others, "acceleration deceleration jerk")],
    ),
    element(&["joint"], &["mimic"], &[(Settled, "joint multiplier offset")]),
    closed(Others, &["joint"], &["safety_controller", "calibration", "hardwareInterface"]),
    closed(Others, &["robot"], &["ros2_control", "group"]),
    closed(Others, ANYWHERE, &["gazebo", "mujoco", "drake", "sensor", "plugin"]),
];

const MJCF: &[Element] = &[
    element(&[""], &["mujoco"], &[(Settled, "model")]),
    element(
        &["mujoco"],
        &["compiler"],
        &[
            (Settled, "angle eulerseq meshdir assetdir autolimits inertiafromgeom coordinate settotalmass boundmass"),
            (Settled, "boundinertia balanceinertia inertiagrouprange fitaabb strippath usethread fusestatic"),
            (Settled, "alignfree saveinertial savecanonical savecompiled passthrough conflict"),
            (Settled, "texturedir discardvisual"),
        ],
    ),
    closed(Solver, &["compiler"], &["lengthrange"]),
    element(
        &["mujoco"],
        &["option"],
        &[
            (Settled, "gravity density viscosity wind actuatorgroupdisable"),
            (Contacts, "o_friction o_margin o_solimp o_solref"),
            (
                Solver,
                "timestep integrator cone impratio jacobian solver iterations tolerance ls_iterations ls_tolerance",
            ),
            (Solver, "noslip_iterations noslip_tolerance ccd_iterations ccd_tolerance mpr_iterations mpr_tolerance"),
            (Solver, "sdf_initpoints sdf_iterations sleep_tolerance apirate collision"),
            (Others, "magnetic"),
        ],
    ),
    element(
        &["option"],
        &["flag"],
        &[
            (Settled, "gravity constraint passive spring damper frictionloss limit equality contact actuation sensor"),
            (Contacts, "filterparent midphase multiccd nativeccd override"),
            (Solver, "autoreset clampctrl diagexact energy eulerdamp fwdinv invdiscrete ipc island refsafe sleep"),
            (Solver, "speculative warmstart"),
        ],
    ),
    closed(Solver, &["mujoco"], &["size", "statistic"]),
    closed(Looks, &["mujoco"], &["visual"]),
    closed(Others, &["mujoco"], &["custom"]),
    element(&["mujoco", "default"], &["default"], &[(Settled, "class")]),
    closed(Settled, &["default"], &["pair", "tendon"]),
    element(&["mujoco"], &["asset"], &[]),
    element(
        &["asset", "default"],
        &["mesh"],
        &[
            (Settled, "name class file scale refpos refquat inertia builtin params vertex face normal texcoord"),
            (Settled, "content_type"),
            (Contacts, "maxhullvert"),
            (Looks, "material smoothnormal"),
        ],
    ),
    closed(Looks, &["asset", "default"], &["texture", "material", "skin", "hfield"]),
    closed(Settled, &["asset"], &["model"]),
    element(
        &["mujoco", "worldbody", "body", "frame"],
        &["worldbody", "body"],
        &[(Settled, "name childclass mocap gravcomp"), PLACE, (Solver, "simple sleep fuse"), (Others, "user")],
    ),
    element(IN_BODIES, &["frame"], &[(Settled, "name childclass"), PLACE]),
    element(IN_BODIES, &["inertial"], &[(Settled, "mass diaginertia fullinertia"), PLACE]),
    element(
        IN_BODIES_AND_CLASSES,
        &["joint"],
        &[
            (Settled, "name class type pos axis ref springref damping stiffness frictionloss armature springdamper"),
            (Settled, "range limited actuatorfrclimited actuatorfrcrange actuatorgravcomp"),
            (Mechanics, "springyield"),
            (Solver, "solreflimit solimplimit solreffriction solimpfriction margin"),
            (Looks, "group"),
            (Others, "user"),
        ],
    ),
    element(IN_BODIES, &["freejoint"], &[(Settled, "name align"), (Looks, "group")]),
    element(
        IN_BODIES_AND_CLASSES,
        &["geom"],
        &[
            (Settled, "name class type size fromto mesh hfield mass density group rgba shellinertia fitscale contype"),
            (Settled, "conaffinity"),
            PLACE,
            (Contacts, "condim friction margin gap priority solmix solref solimp adhesion surfacevel"),
            (Mechanics, "fluidshape fluidcoef"),
            (Looks, "material castshadow"),
            (Others, "user"),
        ],
    ),
    element(
        IN_BODIES_AND_CLASSES,
        &["site"],
        &[
            (Settled, "name class"),
            PLACE,
            (Mechanics, "fromto"),
            (Looks, "type size group rgba material mesh"),
            (Others, "user"),
        ],
    ),
    closed(Looks, IN_BODIES_AND_CLASSES, &["camera", "light"]),
    // They are refused.
    closed(Settled, IN_BODIES, &["replicate", "composite", "flexcomp", "attach"]),
    closed(Others, &["worldbody", "body", "frame", "geom", "mesh"], &["plugin"]),
    closed(Settled, &["mujoco"], &["contact", "tendon", "sensor", "keyframe", "deformable", "extension", "plugin"]),
    element(&["mujoco"], &["actuator"], &[]),
    element(
        &["actuator", "default"],
        MOTORS,
        &[
            (Settled, "name class joint jointinparent gear armature damping"),
            // What drives is not read; the motors are reported together.
            (
                Settled,
                "actdim actearly actlimited actrange area bias biasprm biastype body cogging controller cranklength",
            ),
            (
                Settled,
                "cranksite ctrllimited ctrlrange dampratio delay diameter dynprm dyntype ffrange force forcelimited",
            ),
            (Settled, "forcerange fpmax fvmax gain gainprm gaintype group imax inductance inheritrange input instance"),
            (Settled, "interp ki kp kv lengthrange lmax lmin lugre motorconst nominal nsample plugin posrange range"),
            (Settled, "refsite resistance saturation scale site slewmax slidersite tausmooth tendon thermal timeconst"),
            (Settled, "user velrange vmax"),
        ],
    ),
    closed(Settled, &["plugin"], &["config"]),
    element(&["mujoco", "default"], &["equality"], &[(Settled, "active"), (Solver, "solref solimp")]),
    element(
        &["equality"],
        &["connect", "weld"],
        &[(Settled, "name class active body1 body2 anchor relpose site1 site2 torquescale"), (Solver, "solref solimp")],
    ),
    element(
        &["equality"],
        &["joint"],
        &[(Settled, "name class active joint1 joint2 polycoef"), (Solver, "solref solimp")],
    ),
    closed(Settled, &["equality"], &["tendon", "flex", "flexvert", "flexstrain", "distance"]),
];

/// A word that a format does not have, where it is first, and how often it is there.
pub(crate) struct Unknown {
    what: String,
    at: Range<usize>,
    help: Option<String>,
    count: usize,
}

impl Unknown {
    /// As a line of a list.
    fn listed(&self, whole: &Whole) -> String {
        let more = if self.count > 1 { format!(", and {} more", self.count - 1) } else { String::new() };
        let help = self.help.as_ref().map_or(String::new(), |help| format!("; {help}"));
        format!("unknown {} ({}{more}){help}", self.what, whole.line(self.at.start))
    }

    /// As a remark beside the errors of a file.
    pub(crate) fn noted(self) -> Diagnostic {
        let note = Diagnostic::warning(codes::NOT_IMPORTED, format!("unknown {}", self.what)).at(self.at, "");
        note.help_if(self.help)
    }
}

/// What the words of a file are, beside those that are read.
#[derive(Default)]
pub(crate) struct Wording {
    /// Those that the format does not have.
    pub(crate) unknown: Vec<Unknown>,
    /// Where these are, by what they are.
    places: HashMap<String, usize>,
    /// How many kinds of them are not there any more.
    further: usize,
    beside: Vec<(About, String)>,
}

impl Wording {
    /// Of the elements of a file, which is a URDF or MJCF.
    pub(crate) fn of(root: Node<'_, '_>) -> Self {
        let mut wording = Self::default();
        let table = if root.has_tag_name("robot") { URDF } else { MJCF };
        wording.element(root, "", table);
        wording
    }

    /// The words that are not known, a line for each.
    pub(crate) fn listed(&self, whole: &Whole) -> impl Iterator<Item = String> {
        let further = (self.further > 0).then(|| format!("unknown words, {} more of them", self.further));
        self.unknown.iter().map(|one| one.listed(whole)).chain(further)
    }

    /// The words that are known and not carried over, a line for what each is about.
    pub(crate) fn beside(&self) -> impl Iterator<Item = String> {
        LISTED.iter().filter_map(|(about, what)| {
            let words: Vec<&str> =
                self.beside.iter().filter(|(own, _)| own == about).map(|(_, word)| word.as_str()).collect();
            (!words.is_empty()).then(|| format!("{what}: {}", words.join(", ")))
        })
    }

    fn element(&mut self, node: Node<'_, '_>, parent: &str, table: &'static [Element]) {
        let name = node.tag_name().name();
        // What has a prefix is of the program whose prefix it is.
        if node.tag_name().namespace() != node.document().root_element().tag_name().namespace() {
            self.note(Others, format!("<{name}>"));
            return;
        }
        let known = table.iter().filter(|element| element.names.contains(&name));
        let here = known.clone().find(|element| element.inside == ANYWHERE || element.inside.contains(&parent));
        let Some(element) = here else {
            self.unknown(format!("element <{name}> in <{parent}>"), head(&node), || {
                let places = known.flat_map(|one| one.inside).filter(|place| !place.is_empty());
                let places: Vec<String> = places.map(|place| format!("<{place}>")).collect();
                if !places.is_empty() {
                    return (String::new(), Some(format!("it belongs in {}", places.join(", "))));
                }
                let names = table.iter().filter(|element| element.inside.contains(&parent)).flat_map(|one| one.names);
                (String::new(), suggest(name, names.copied()).map(|meant| format!("did you mean <{meant}>?")))
            });
            return;
        };
        let attributes = match element.words {
            Attributes(attributes) => attributes,
            Closed(about) => return self.note(about, format!("<{name}>")),
        };
        for attribute in node.attributes() {
            let word = attribute.name();
            if attribute.namespace().is_some() {
                self.note(Others, format!("`{word}`"));
                continue;
            }
            let has = |words: &str| words.split(' ').any(|one| one == word);
            match attributes.iter().find(|(_, words)| has(words)) {
                Some((about, _)) => self.note(*about, format!("`{word}`")),
                None => self.unknown(format!("attribute `{word}` of <{name}>"), attribute.range(), || {
                    let meant = suggest(word, attributes.iter().flat_map(|(_, words)| words.split(' ')));
                    let value: String = attribute.value().chars().take(SHOWN).collect();
                    (format!(": {value}"), meant.map(|meant| format!("did you mean `{meant}`?")))
                }),
            }
        }
        for below in children(node) {
            self.element(below, name, table);
        }
    }

    /// Counts a word that is not known; what more there is to say of it is asked for where it is first.
    fn unknown(&mut self, what: String, at: Range<usize>, more: impl FnOnce() -> (String, Option<String>)) {
        if let Some(place) = self.places.get(&what) {
            self.unknown[*place].count += 1;
        } else if self.unknown.len() < MOST {
            let (value, help) = more();
            self.places.insert(what.clone(), self.unknown.len());
            self.unknown.push(Unknown { what: what + &value, at, help, count: 1 });
        } else {
            self.further += 1;
        }
    }

    fn note(&mut self, about: About, word: String) {
        let is_there = |(own, there): &(About, String)| *own == about && *there == word;
        if about != Settled && self.beside.len() < MOST_BESIDE && !self.beside.iter().any(is_there) {
            self.beside.push((about, word));
        }
    }
}

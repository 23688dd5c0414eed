//! [`Pruning`]: which of the plan's savings are allowed. All are, unless a scene or the command line says `without`.

/// Savings that can be switched off: name, and what is done without it.
pub const SAVINGS: &[(&str, &str)] = &[
    ("kinematic", "mechanisms driven in all their freedoms are integrated"),
    ("row-choice", "dependent rows stay in use: rank-safe elimination for every evaluation"),
    (
        "affine-loops",
        "joint coordinates that follow others (in parallelograms) stay, with the rows that close their loops",
    ),
    ("on-demand", "accelerations and reactions are solved for at output times even if no output asks for them"),
    ("audit", "the violation of all rows is looked at in every accepted state, in joint coordinates too"),
    ("events", "steps are not made to end where equations switch (contact, friction, limits)"),
];

/// What is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pruning {
    /// No integration of motions that the time determines.
    pub kinematic: bool,
    /// A choice of independent rows, and the rank-safe engine only where the rank falls.
    pub row_choice: bool,
    /// No joint coordinates that follow others by affine relations, nor the rows that they make up for.
    pub affine_loops: bool,
    /// Accelerations and reactions at output times only where an output asks for them.
    pub on_demand: bool,
    /// In joint coordinates, looks at the violation of all rows in some accepted states only.
    pub audit: bool,
    /// Steps that end where equations switch, instead of many that approach it.
    pub events: bool,
}

impl Default for Pruning {
    fn default() -> Self {
        Self { kinematic: true, row_choice: true, affine_loops: true, on_demand: true, audit: true, events: true }
    }
}

impl Pruning {
    /// All but the savings named.
    ///
    /// # Errors
    /// The position of the first name that is none of [`SAVINGS`].
    pub fn without<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Self, usize> {
        let mut allowed = Self::default();
        for (k, name) in names.into_iter().enumerate() {
            let switch = match name {
                "kinematic" => &mut allowed.kinematic,
                "row-choice" => &mut allowed.row_choice,
                "affine-loops" => &mut allowed.affine_loops,
                "on-demand" => &mut allowed.on_demand,
                "audit" => &mut allowed.audit,
                "events" => &mut allowed.events,
                _ => return Err(k),
            };
            *switch = false;
        }
        Ok(allowed)
    }
}

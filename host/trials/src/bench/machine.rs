//! [`Machine`]: where measurements were made.

/// The machine and the program.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Machine {
    /// Model of the processor; `unknown` where the system does not say.
    pub processor: String,
    /// Threads that can run at the same time.
    pub cores: usize,
    /// Operating system and architecture.
    pub system: String,
    /// Version of this program.
    pub version: String,
    /// `release`, or `debug` if it was built with debug assertions.
    pub build: &'static str,
}

impl Machine {
    /// This one.
    #[must_use]
    pub fn this() -> Self {
        Self {
            processor: processor().unwrap_or_else(|| "unknown".into()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            version: env!("CARGO_PKG_VERSION").into(),
            build: if cfg!(debug_assertions) { "debug" } else { "release" },
        }
    }

    /// In a line.
    #[must_use]
    pub fn line(&self) -> String {
        let Self { processor, cores, system, version, build } = self;
        format!("O-DYN {version} ({build} build), {processor}, {cores} cores, {system}")
    }
}

/// As Linux reports it.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}

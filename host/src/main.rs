//! The program `odyn`; `odyn --help` says what it does. Everything it can do, the library can do without it.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}

//! Exported programs, built and run.

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use odyn::export::Machine;
use odyn::export::c::{Real, package};

/// With this set, what needs a compiler of C is left out where there is none.
const SKIP: &str = "ODYN_SKIP_C";

/// Reads commands and answers with numbers.
const HARNESS: &str = r#"
#include <stdio.h>
#include "@n@.h"

static @n@_machine m;
static @n@_real y[@N@_STATES], found[@N@_STATES];
#ifdef @N@_SEEDS
static @n@_real outputs[@N@_OUTPUTS + 1], switches[@N@_SWITCHES + 1];
#endif

static void show(const @n@_real *values, int number) {
    int k;
    for (k = 0; k < number; ++k) {
        printf(" %.17g", (double)values[k]);
    }
}

static int state(void) {
    int k;
    double value;
    for (k = 0; k < @N@_STATES; ++k) {
        if (scanf("%lf", &value) != 1) {
            return 0;
        }
        y[k] = (@n@_real)value;
    }
    return 1;
}

int main(void) {
    char command;
    int number, status;
    double value;
    @n@_start(&m);
    while (scanf(" %c", &command) == 1) {
        switch (command) {
        case 's':
            if (scanf("%lf", &value) != 1) return 1;
            status = @n@_step(&m, (@n@_real)value);
            printf("%d %.17g", status, (double)m.time);
            show(m.state, @N@_STATES);
            break;
        case 'i':
            if (scanf("%d %lf", &number, &value) != 2) return 1;
#if @N@_INPUTS > 0
            m.input[number] = (@n@_real)value;
#endif
            printf("0");
            break;
        case 'o':
            @n@_outputs(&m);
            printf("0");
#if @N@_OUTPUTS > 0
            show(m.output, @N@_OUTPUTS);
#endif
            break;
        case 'r':
            if (!state()) return 1;
            status = @n@_rates(&m, m.time, y, found);
            printf("%d", status);
            show(found, @N@_STATES);
            break;
        case 'p':
            if (!state()) return 1;
            status = @n@_project(&m, m.time, y);
            printf("%d", status);
            show(y, @N@_STATES);
            break;
#if @N@_PARAMETERS > 0
        case 'q':
            for (number = 0; number < @N@_PARAMETERS; ++number) {
                if (scanf("%lf", &value) != 1) return 1;
                m.parameter[number] = (@n@_real)value;
            }
            printf("%d", @n@_follow_parameters(&m));
            break;
#endif
#ifdef @N@_SEEDS
        case 'd':
            for (number = 0; number < @N@_SEEDS; ++number) {
                if (scanf("%lf", &value) != 1) return 1;
                m.seed[number] = (@n@_real)value;
            }
            @n@_derivatives(&m, found, outputs, switches);
            printf("0");
            show(found, @N@_STATES);
            show(outputs, @N@_OUTPUTS);
            show(switches, @N@_SWITCHES);
            break;
#endif
        case 'm':
            printf("0 %lu", (unsigned long)sizeof m);
            break;
        default:
            return 1;
        }
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
"#;

/// An exported program that runs.
pub struct Program {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Whether a program can be called; what is left out for want of it is reported.
fn is_there(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok();
    if !there {
        println!("left out: there is no `{program}`");
    }
    there
}

/// Writes the files of a machine.
fn files(machine: &Machine, real: Real, folder: &Path) -> PathBuf {
    for (name, text) in package(machine, real).unwrap().files {
        fs::write(folder.join(name), text).unwrap();
    }
    folder.join(format!("{}.c", machine.name))
}

fn filled(text: &str, machine: &Machine) -> String {
    text.replace("@n@", &machine.name).replace("@N@", &machine.name.to_uppercase())
}

fn run(command: &mut Command) {
    let output = command.output().expect("the program can be run");
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
}

const STRICT: &[&str] = &["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off"];

impl Program {
    /// Builds it with the C compiler; `None` where there is none and that may be.
    pub fn build(machine: &Machine, real: Real, folder: &Path, flags: &[&str]) -> Option<Self> {
        if Command::new("cc").arg("--version").output().is_err() {
            let skip = std::env::var_os(SKIP).is_some();
            assert!(skip, "there is no compiler `cc`; set {SKIP}=1 to leave out the tests that need it");
        }
        Self::by("cc", machine, real, folder, flags)
    }

    /// The same with any compiler; `None` where it is not there.
    pub fn by(compiler: &str, machine: &Machine, real: Real, folder: &Path, flags: &[&str]) -> Option<Self> {
        if !is_there(compiler) {
            return None;
        }
        let source = files(machine, real, folder);
        let harness = folder.join("harness.c");
        fs::write(&harness, filled(HARNESS, machine)).unwrap();
        let (object, program) = (folder.join(format!("{}.o", machine.name)), folder.join("program"));
        run(Command::new(compiler)
            .current_dir(folder)
            .args(STRICT)
            .args(flags)
            .arg("-c")
            .arg("-o")
            .arg(&object)
            .arg(&source));
        let example = folder.join("main.c");
        run(Command::new(compiler)
            .args(STRICT)
            .args(flags)
            .arg("-c")
            .arg("-o")
            .arg(folder.join("main.o"))
            .arg(example));
        run(Command::new(compiler)
            .args(["-std=c99"])
            .args(flags)
            .arg("-o")
            .arg(&program)
            .arg(&harness)
            .arg(&object)
            .arg("-lm"));
        let mut child = Command::new(&program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (to, from) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        Some(Self { child, to, from })
    }

    /// Status and numbers that a command is answered with.
    fn ask(&mut self, command: &str) -> (i32, Vec<f64>) {
        writeln!(self.to, "{command}").unwrap();
        self.to.flush().unwrap();
        let mut line = String::new();
        self.from.read_line(&mut line).unwrap();
        let mut words = line.split_whitespace();
        let status = words.next().unwrap_or_else(|| panic!("no answer to `{command}`")).parse().unwrap();
        let number = |word: &str| word.replace("nan", "NaN").parse().unwrap();
        (status, words.map(number).collect())
    }

    /// Status, then time and state.
    pub fn step(&mut self, h: f64) -> (i32, Vec<f64>) {
        self.ask(&format!("s {h:e}"))
    }

    pub fn set_input(&mut self, number: usize, value: f64) {
        self.ask(&format!("i {number} {value:e}"));
    }

    pub fn outputs(&mut self) -> Vec<f64> {
        self.ask("o").1
    }

    pub fn rates(&mut self, state: &[f64]) -> (i32, Vec<f64>) {
        self.ask(&of_state("r", state))
    }

    pub fn project(&mut self, state: &[f64]) -> (i32, Vec<f64>) {
        self.ask(&of_state("p", state))
    }

    /// The status of setting all parameters.
    pub fn set_parameters(&mut self, values: &[f64]) -> i32 {
        self.ask(&of_state("q", values)).0
    }

    /// Derivatives of rates, outputs and switches along a direction.
    pub fn derivatives(&mut self, seed: &[f64]) -> Vec<f64> {
        self.ask(&of_state("d", seed)).1
    }

    pub fn memory(&mut self) -> usize {
        self.ask("m").1[0] as usize
    }
}

fn of_state(command: &str, state: &[f64]) -> String {
    state.iter().fold(command.to_string(), |mut text, value| {
        let _ = write!(text, " {value:e}");
        text
    })
}

/// The largest stack of a step by what the compiler says of the functions, as deep as they call each other: step, advance, rates,
/// run, one of its parts, turn.
pub fn stack_used(folder: &Path, name: &str) -> usize {
    let text = fs::read_to_string(folder.join(format!("{name}.su"))).unwrap();
    let mut sizes: Vec<usize> = text.lines().map(|line| line.split('\t').nth(1).unwrap().parse().unwrap()).collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    assert!(!sizes.is_empty());
    sizes.iter().take(6).sum()
}

/// Prints the state after so many steps, on a processor without operating system: semihosting writes to the emulator.
const BARE: &str = r#"
#include <stdio.h>
#include "@n@.h"
static @n@_machine m;
extern void initialise_monitor_handles(void);
int main(void) {
    int k;
    initialise_monitor_handles();
    @n@_start(&m);
    for (k = 0; k < @STEPS@; ++k) {
        if (@n@_step(&m, @N@_STEP) != @N@_OK) {
            printf("failed\n");
            return 1;
        }
    }
    for (k = 0; k < @N@_STATES; ++k) {
        printf("%.17g\n", m.state[k]);
    }
    return 0;
}
"#;

/// Vectors and start of a Cortex-M3 (the board `mps2-an385` of qemu).
const STARTUP: &str = r#"
extern unsigned char end_of_stack[];
extern int main(void);
extern void exit(int);
extern unsigned char __bss_start__[], __bss_end__[];
void _init(void);
void _init(void) {
}
void _fini(void);
void _fini(void) {
}
void reset(void);
void reset(void) {
    unsigned char *at;
    for (at = __bss_start__; at < __bss_end__; ++at) {
        *at = 0;
    }
    exit(main());
}
void fault(void);
void fault(void) {
    for (;;) {
    }
}
__attribute__((section(".vectors"), used)) void *const vectors[16] = {
    end_of_stack, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault
};
"#;

const LINKED: &str = "\
ENTRY(reset)
MEMORY { code (rwx) : ORIGIN = 0x00000000, LENGTH = 4M
         data (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) KEEP(*(.init)) KEEP(*(.fini)) } > code
  .ARM.exidx : { *(.ARM.exidx*) } > code
  .data : { *(.data*) } > code
  .bss : { __bss_start__ = .; *(.bss*) *(COMMON) . = ALIGN(8); __bss_end__ = .; end = .; _end = .; } > data
  end_of_stack = ORIGIN(data) + LENGTH(data);
}
";

/// What a Cortex-M3 prints as the state after so many steps; `None` where compiler or emulator are not there.
pub fn on_cortex_m(machine: &Machine, folder: &Path, steps: usize) -> Option<String> {
    let compiler = "arm-none-eabi-gcc";
    if !is_there(compiler) || !is_there("qemu-system-arm") {
        return None;
    }
    let source = files(machine, Real::Double, folder);
    let file = |name: &str, text: &str| {
        fs::write(folder.join(name), text).unwrap();
        folder.join(name)
    };
    let main = file("bare.c", &filled(BARE, machine).replace("@STEPS@", &steps.to_string()));
    let startup = file("startup.c", STARTUP);
    let script = file("bare.ld", LINKED);
    let program = folder.join("bare.elf");
    let processor = ["-mcpu=cortex-m3", "-mthumb", "-mfloat-abi=soft"];
    let object = folder.join("bare-machine.o");
    run(Command::new(compiler).args(STRICT).args(processor).args(["-O2", "-c", "-o"]).arg(&object).arg(source));
    let output = Command::new(compiler)
        .args(processor)
        .args(["-std=gnu99", "-O2", "--specs=rdimon.specs", "-nostartfiles", "-T"])
        .arg(script)
        .arg("-o")
        .arg(&program)
        .args([&main, &startup, &object])
        .arg("-lm")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = Command::new("qemu-system-arm")
        .args(["-machine", "mps2-an385", "-nographic", "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(&program)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    Some(String::from_utf8(output.stdout).unwrap())
}

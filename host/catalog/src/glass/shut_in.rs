//! A process shuts itself in, before it runs foreign code: bounded memory, nothing but reading the system's libraries, no network,
//! no other processes, no signals to others. What can't be had on a system is left out.
//!
//! What libraries may ask for in good faith (a file that is not there, the folder, an identity) fails. What no element needs ends the
//! process with `SIGSYS`, which nobody can catch, and the host says so: other processes, the network, files changed.

// Functions of the system that take plain numbers.
#![allow(unsafe_code)]

use std::path::Path;

/// Largest address space of a recorder, bytes.
const MOST_MEMORY: libc::rlim_t = 4 << 30;
/// Most files it has open at once.
const MOST_FILES: libc::rlim_t = 64;

/// Shuts this thread, and all that it starts, in with the library in the file `copy`, which is to be loaded then. Whether files
/// are out of reach already; otherwise [`no_more_files`] is for afterwards.
pub(super) fn shut_in(copy: &Path) -> bool {
    for (what, most) in [
        (libc::RLIMIT_AS, MOST_MEMORY),
        (libc::RLIMIT_NOFILE, MOST_FILES),
        (libc::RLIMIT_FSIZE, 0),
        (libc::RLIMIT_CORE, 0),
    ] {
        let limit = libc::rlimit { rlim_cur: most, rlim_max: most };
        // SAFETY: reads the struct. Where the limit was lower already, it stays.
        unsafe { libc::setrlimit(what, &raw const limit) };
    }
    #[cfg(target_os = "linux")]
    return linux::shut_in(copy);
    #[cfg(not(target_os = "linux"))]
    return copy.as_os_str().is_empty();
}

/// What this system cannot keep a recorder from, in words; empty where nothing is missing.
pub(super) fn missing() -> &'static str {
    #[cfg(target_os = "linux")]
    return linux::missing();
    #[cfg(not(target_os = "linux"))]
    "this system cannot keep it from files, other processes and the network"
}

/// From now on nothing can be opened, where the system has filters of calls.
pub(super) fn no_more_files() {
    #[cfg(target_os = "linux")]
    linux::no_more_files();
}

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeMap;
    use std::path::{Path, PathBuf};

    use landlock::{
        ABI, Access, AccessFs, AccessNet, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, RulesetStatus, Scope,
        path_beneath_rules,
    };
    use seccompiler::{
        BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
        apply_filter,
    };

    /// Where systems keep the libraries that libraries need.
    const SYSTEM: [&str; 9] = [
        "/lib",
        "/lib32",
        "/lib64",
        "/usr/lib",
        "/usr/lib32",
        "/usr/lib64",
        "/usr/local/lib",
        "/nix/store",
        "/gnu/store",
    ];

    pub(super) fn shut_in(copy: &Path) -> bool {
        let files = no_files_but(copy).unwrap_or(false);
        for filter in ending().into_iter().chain(filters().into_iter().flatten()) {
            // A kernel without filters runs the library in a process of its own all the same.
            let _ = apply_filter(&filter);
        }
        files
    }

    pub(super) fn missing() -> &'static str {
        const VERSION: libc::c_uint = 1;
        // SAFETY: asks for the version only; no attributes are given.
        let landlock = unsafe {
            libc::syscall(libc::SYS_landlock_create_ruleset, std::ptr::null::<libc::c_void>(), 0_usize, VERSION)
        };
        // SAFETY: a null pointer is no filter. A kernel that knows filters says that it cannot be read, another one that it is no mode.
        let refused =
            unsafe { libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, std::ptr::null::<libc::c_void>()) };
        let seccomp = refused != 0 && std::io::Error::last_os_error().raw_os_error() == Some(libc::EFAULT);
        match (landlock > 0, seccomp) {
            (true, true) => "",
            (false, true) => "this kernel has no Landlock, so it can read files while it is loaded",
            (_, false) => "this kernel has no seccomp, so it can start processes and use the network",
        }
    }

    pub(super) fn no_more_files() {
        let open = [
            libc::SYS_openat,
            #[cfg(target_arch = "x86_64")]
            libc::SYS_open,
        ];
        if let Some(filter) = refusing(&open, libc::EACCES) {
            let _ = apply_filter(&filter);
        }
    }

    /// All calls but these.
    fn refusing(calls: &[i64], error: libc::c_int) -> Option<BpfProgram> {
        let calls = calls.iter().map(|call| (*call, Vec::new())).collect();
        let arch = std::env::consts::ARCH.try_into().ok()?;
        let filter = SeccompFilter::new(calls, SeccompAction::Allow, SeccompAction::Errno(error as u32), arch).ok()?;
        filter.try_into().ok()
    }

    /// Reading the library and those of the system is all that is left of the file system; no sockets, no signals to others.
    fn no_files_but(copy: &Path) -> Result<bool, RulesetError> {
        let abi = ABI::V6;
        let named = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        let folders = SYSTEM.iter().map(PathBuf::from).chain(std::env::split_paths(&named));
        let folders: Vec<PathBuf> = folders.filter(|folder| folder.is_absolute() && folder.is_dir()).collect();
        let files = [copy, Path::new("/etc/ld.so.cache")];
        // The folder of an FMU is read as a whole.
        let (files, folders) = match copy.is_dir() {
            true => (&files[1..], folders.into_iter().chain([copy.into()]).collect()),
            false => (&files[..], folders),
        };
        let read = AccessFs::ReadFile | AccessFs::ReadDir | AccessFs::Execute;
        let status = Ruleset::default()
            .handle_access(AccessFs::from_all(abi))?
            .handle_access(AccessNet::from_all(abi))?
            .scope(Scope::from_all(abi))?
            .create()?
            .add_rules(path_beneath_rules(folders, read))?
            .add_rules(path_beneath_rules(files, AccessFs::ReadFile | AccessFs::Execute))?
            .restrict_self()?;
        Ok(status.ruleset != RulesetStatus::NotEnforced)
    }

    /// The calls that computing, memory, threads and loading libraries need; whatever else is asked of the system fails.
    fn filters() -> Option<[BpfProgram; 2]> {
        let arch = std::env::consts::ARCH.try_into().ok()?;
        let own = u64::from(std::process::id());
        let is = |argument, value| rule(argument, SeccompCmpOp::Eq, value);
        let thread = libc::CLONE_THREAD as u64;
        let mut calls: BTreeMap<i64, Vec<SeccompRule>> = FREE.iter().map(|call| (*call, Vec::new())).collect();
        calls.insert(libc::SYS_clone, vec![rule(0, SeccompCmpOp::MaskedEq(thread), thread)?]);
        // To itself only: `abort` sends a signal.
        calls.insert(libc::SYS_kill, vec![is(0, own)?]);
        calls.insert(libc::SYS_tgkill, vec![is(0, own)?]);
        calls.insert(libc::SYS_prlimit64, vec![is(0, 0)?, is(0, own)?]);
        // Not F_SETOWN, which sends signals to others.
        let harmless =
            [libc::F_DUPFD, libc::F_GETFD, libc::F_SETFD, libc::F_GETFL, libc::F_SETFL, libc::F_DUPFD_CLOEXEC];
        calls.insert(libc::SYS_fcntl, harmless.iter().map(|what| is(1, *what as u64)).collect::<Option<_>>()?);
        // More filters only take away: `no_more_files` is one.
        let named = [libc::PR_SET_NAME, libc::PR_SET_VMA, libc::PR_SET_NO_NEW_PRIVS];
        calls.insert(libc::SYS_prctl, named.iter().map(|what| is(0, *what as u64)).collect::<Option<_>>()?);
        let refuse = SeccompAction::Errno(libc::EPERM as u32);
        let listed = SeccompFilter::new(calls, refuse, SeccompAction::Allow, arch).ok()?;
        // Its flags lie in memory, where no filter can see them; libraries then take `clone`.
        Some([refusing(&[libc::SYS_clone3], libc::ENOSYS)?, listed.try_into().ok()?])
    }

    /// The calls that end the process.
    fn ending() -> Option<BpfProgram> {
        let arch = std::env::consts::ARCH.try_into().ok()?;
        let own = u64::from(std::process::id());
        let other = |argument| condition(argument, SeccompCmpOp::Ne, own);
        let mut calls: BTreeMap<i64, Vec<SeccompRule>> = ENDING.iter().map(|call| (*call, Vec::new())).collect();
        calls.insert(libc::SYS_clone, vec![rule(0, SeccompCmpOp::MaskedEq(libc::CLONE_THREAD as u64), 0)?]);
        for signal in [libc::SYS_kill, libc::SYS_tgkill] {
            calls.insert(signal, vec![SeccompRule::new(vec![other(0)?]).ok()?]);
        }
        let of_others = vec![other(0)?, condition(0, SeccompCmpOp::Ne, 0)?];
        calls.insert(libc::SYS_prlimit64, vec![SeccompRule::new(of_others).ok()?]);
        // Sockets of this machine alone only fail: the system's own functions look for services by them.
        calls.insert(libc::SYS_socket, vec![rule(0, SeccompCmpOp::Ne, libc::AF_UNIX as u64)?]);
        let to_write = |flags: u8| {
            let is =
                |mask: libc::c_int, value: libc::c_int| rule(flags, SeccompCmpOp::MaskedEq(mask as u64), value as u64);
            let access = libc::O_ACCMODE;
            Some(vec![is(access, libc::O_WRONLY)?, is(access, libc::O_RDWR)?, is(libc::O_CREAT, libc::O_CREAT)?])
        };
        calls.insert(libc::SYS_openat, to_write(2)?);
        #[cfg(target_arch = "x86_64")]
        calls.insert(libc::SYS_open, to_write(1)?);
        let filter = SeccompFilter::new(calls, SeccompAction::Allow, SeccompAction::KillProcess, arch).ok()?;
        filter.try_into().ok()
    }

    fn condition(argument: u8, op: SeccompCmpOp, value: u64) -> Option<SeccompCondition> {
        SeccompCondition::new(argument, SeccompCmpArgLen::Dword, op, value).ok()
    }

    fn rule(argument: u8, op: SeccompCmpOp, value: u64) -> Option<SeccompRule> {
        SeccompRule::new(vec![condition(argument, op, value)?]).ok()
    }

    /// Calls that nobody makes in good faith who is asked for equations.
    const ENDING: &[i64] = &[
        libc::SYS_bpf,
        libc::SYS_execve,
        libc::SYS_execveat,
        libc::SYS_fchmodat,
        libc::SYS_fchownat,
        libc::SYS_linkat,
        libc::SYS_mkdirat,
        libc::SYS_mknodat,
        libc::SYS_mount,
        libc::SYS_process_vm_readv,
        libc::SYS_process_vm_writev,
        libc::SYS_ptrace,
        libc::SYS_renameat2,
        libc::SYS_symlinkat,
        libc::SYS_truncate,
        libc::SYS_unlinkat,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_chmod,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_chown,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_creat,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_fork,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_link,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_mkdir,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_rename,
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        libc::SYS_renameat,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_rmdir,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_symlink,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_unlink,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_vfork,
    ];

    /// Calls that reach nothing but the process itself and the files that it may open.
    const FREE: &[i64] = &[
        libc::SYS_brk,
        libc::SYS_clock_getres,
        libc::SYS_clock_gettime,
        libc::SYS_clock_nanosleep,
        libc::SYS_clone3,
        libc::SYS_close,
        libc::SYS_dup,
        libc::SYS_exit,
        libc::SYS_exit_group,
        libc::SYS_faccessat,
        libc::SYS_fstat,
        libc::SYS_futex,
        libc::SYS_getcwd,
        libc::SYS_getegid,
        libc::SYS_geteuid,
        libc::SYS_getgid,
        libc::SYS_getpid,
        libc::SYS_getppid,
        libc::SYS_getrandom,
        libc::SYS_getrusage,
        libc::SYS_gettid,
        libc::SYS_gettimeofday,
        libc::SYS_getuid,
        libc::SYS_lseek,
        libc::SYS_madvise,
        libc::SYS_membarrier,
        libc::SYS_mmap,
        libc::SYS_mprotect,
        libc::SYS_mremap,
        libc::SYS_munmap,
        libc::SYS_nanosleep,
        libc::SYS_newfstatat,
        libc::SYS_openat,
        libc::SYS_ppoll,
        libc::SYS_pread64,
        libc::SYS_read,
        libc::SYS_readlinkat,
        libc::SYS_readv,
        libc::SYS_restart_syscall,
        libc::SYS_rseq,
        libc::SYS_rt_sigaction,
        libc::SYS_rt_sigprocmask,
        libc::SYS_rt_sigreturn,
        libc::SYS_sched_getaffinity,
        libc::SYS_sched_yield,
        libc::SYS_seccomp,
        libc::SYS_set_robust_list,
        libc::SYS_set_tid_address,
        libc::SYS_sigaltstack,
        libc::SYS_statx,
        libc::SYS_sysinfo,
        libc::SYS_uname,
        libc::SYS_write,
        libc::SYS_writev,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_access,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_arch_prctl,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_open,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_poll,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_readlink,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_stat,
        #[cfg(target_arch = "x86_64")]
        libc::SYS_time,
    ];
}

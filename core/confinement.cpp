#include "core/confinement.h"

#include <fcntl.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <memory>

namespace terracast::core {

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

/// The addresses that this process has taken; 0: the system does not say.
std::uint64_t address_bytes() {
  unsigned long long pages = 0;
  std::FILE* const file = std::fopen("/proc/self/statm", "re");
  if (file == nullptr) return 0;
  if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
  std::fclose(file);
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

bool set_limit(int resource, std::uint64_t value, std::uint64_t most) {
  const rlimit limit{value, most};
  return ::setrlimit(static_cast<__rlimit_resource>(resource), &limit) == 0;
}

/// Calls that only look, or change nothing but this process's own memory, threads and signals.
constexpr const char* kHarmless[] = {"read",
                                     "readv",
                                     "pread64",
                                     "preadv",
                                     "preadv2",
                                     "write",
                                     "writev",
                                     "close",
                                     "close_range",
                                     "lseek",
                                     "fstat",
                                     "stat",
                                     "lstat",
                                     "newfstatat",
                                     "statx",
                                     "statfs",
                                     "fstatfs",
                                     "access",
                                     "faccessat",
                                     "faccessat2",
                                     "readlink",
                                     "readlinkat",
                                     "getdents64",
                                     "getcwd",
                                     "fadvise64",
                                     "mmap",
                                     "munmap",
                                     "mprotect",
                                     "mremap",
                                     "madvise",
                                     "brk",
                                     "mincore",
                                     "membarrier",
                                     "futex",
                                     "futex_waitv",
                                     "set_robust_list",
                                     "get_robust_list",
                                     "rseq",
                                     "set_tid_address",
                                     "sched_yield",
                                     "sched_getaffinity",
                                     "sched_getparam",
                                     "sched_getscheduler",
                                     "getcpu",
                                     "rt_sigaction",
                                     "rt_sigprocmask",
                                     "rt_sigreturn",
                                     "rt_sigpending",
                                     "sigaltstack",
                                     "exit",
                                     "exit_group",
                                     "restart_syscall",
                                     "getpid",
                                     "gettid",
                                     "getppid",
                                     "getuid",
                                     "geteuid",
                                     "getgid",
                                     "getegid",
                                     "clock_gettime",
                                     "clock_getres",
                                     "clock_nanosleep",
                                     "nanosleep",
                                     "gettimeofday",
                                     "time",
                                     "times",
                                     "getrusage",
                                     "getrlimit",
                                     "getrandom",
                                     "uname",
                                     "sysinfo",
                                     "poll",
                                     "ppoll",
                                     "dup"};

bool filter_system_calls() {
  const std::unique_ptr<void, decltype(&seccomp_release)> filter(
      seccomp_init(SCMP_ACT_ERRNO(ENOSYS)), &seccomp_release);
  if (!filter) return false;
  bool is_whole = true;
  const auto allow = [&](const char* name, std::initializer_list<scmp_arg_cmp> conditions) {
    const int number = seccomp_syscall_resolve_name(name);
    if (number == __NR_SCMP_ERROR) return;  // no such call on this processor
    is_whole = is_whole && seccomp_rule_add_array(filter.get(), SCMP_ACT_ALLOW, number,
                                                  static_cast<unsigned>(conditions.size()),
                                                  conditions.begin()) == 0;
  };
  for (const char* name : kHarmless) allow(name, {});
  // For reading, and of files that are there.
  constexpr scmp_datum_t kChanging = O_ACCMODE | O_CREAT | O_TRUNC | O_APPEND;
  allow("open", {SCMP_A1(SCMP_CMP_MASKED_EQ, kChanging, O_RDONLY)});
  allow("openat", {SCMP_A2(SCMP_CMP_MASKED_EQ, kChanging, O_RDONLY)});
  // Threads, no processes. Libraries go back to clone() where there is no clone3(), whose flags no filter sees.
  constexpr scmp_datum_t kThread = 0x00010000;  // CLONE_THREAD
  allow("clone", {SCMP_A0(SCMP_CMP_MASKED_EQ, kThread, kThread)});
  // F_SETOWN and F_SETSIG, which could signal other processes, are not allowed.
  // SQLite takes locks on what it reads; only locks of readers can be had on what is open for reading.
  for (const scmp_datum_t command :
       {F_GETFD, F_SETFD, F_GETFL, F_DUPFD, F_DUPFD_CLOEXEC, F_GETLK, F_SETLK})
    allow("fcntl", {SCMP_A1(SCMP_CMP_EQ, command)});
  allow("sched_setaffinity", {SCMP_A0(SCMP_CMP_EQ, 0)});
  const auto own = static_cast<scmp_datum_t>(::getpid());
  allow("tgkill", {SCMP_A0(SCMP_CMP_EQ, own)});  // abort()
  allow("prctl", {SCMP_A0(SCMP_CMP_EQ, PR_SET_NAME)});
  allow("prlimit64", {SCMP_A2(SCMP_CMP_EQ, 0)});  // to ask
  return is_whole && seccomp_load(filter.get()) == 0;
}

}  // namespace

Confinement confine_this_process(const ReadingLimits& limits) {
  Confinement done;
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  set_limit(RLIMIT_CORE, 0, 0);
  set_limit(RLIMIT_FSIZE, limits.file_bytes, limits.file_bytes);  // pipes have no size
  // The soft limit sends SIGXCPU; a process that is killed when memory runs out gets SIGKILL instead.
  constexpr std::uint64_t kMore_s = 5;
  const auto cpu_s = static_cast<std::uint64_t>(std::ceil(limits.cpu_s));
  set_limit(RLIMIT_CPU, cpu_s, cpu_s + kMore_s);
  const std::uint64_t taken = address_bytes();
  if (!kIsSanitized && taken > 0)
    done.has_memory_limit =
        set_limit(RLIMIT_AS, taken + limits.memory_bytes, taken + limits.memory_bytes);
  if (!kIsSanitized) done.has_system_call_filter = filter_system_calls();
  return done;
}

}  // namespace terracast::core

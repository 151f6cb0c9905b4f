#include "tests/support/slurm_cluster.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tests/support/run_program.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kCoresPerNode = 2;
constexpr int kMemoryPerNode_mib = 8000;
/// Sockets of munged lie in the cluster's folder, and their names have 107 bytes at most.
constexpr std::size_t kLongestFolder = 80;
/// Somebody else may take a port between our looking for it and the daemon's.
constexpr int kMostStarts = 3;
constexpr auto kPoll = std::chrono::milliseconds(50);

/// Daemons lie where the PATH of a user need not lead.
std::optional<fs::path> find_daemon(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::stringstream folders(std::string(path != nullptr ? path : "") + ":/usr/sbin:/sbin:/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty() && ::access((fs::path(folder) / name).c_str(), X_OK) == 0)
      return fs::path(folder) / name;
  return std::nullopt;
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

// -- processes, as the kernel tells ---------------------------------------------------------------

std::vector<pid_t> all_processes() {
  std::vector<pid_t> numbers;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") == std::string::npos)
      numbers.push_back(static_cast<pid_t>(std::stol(name)));
  }
  return numbers;
}

fs::path proc(pid_t number, const char* file) {
  return fs::path("/proc") / std::to_string(number) / file;
}

/// The fields of a process' record after its name, the first being its state; empty: it is gone.
std::vector<std::string> record_of(pid_t number) {
  const std::string text = text_of(proc(number, "stat"));
  std::vector<std::string> fields;
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return fields;
  std::stringstream rest(text.substr(name_end + 1));
  for (std::string field; rest >> field;) fields.push_back(field);
  return fields;
}

/// All that descend from a process, which takes up those whose parents have ended.
std::vector<pid_t> descendants_of(pid_t root) {
  std::map<pid_t, std::vector<pid_t>> children;
  for (const pid_t number : all_processes())
    if (const auto fields = record_of(number); fields.size() > 1 && fields[0] != "Z")
      children[static_cast<pid_t>(std::stol(fields[1]))].push_back(number);
  std::vector<pid_t> found = children[root];
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::vector<pid_t> next = children[found[i]];
    found.insert(found.end(), next.begin(), next.end());
  }
  return found;
}

/// Of texts that are each ended by a zero.
std::vector<std::string> texts_in(const std::string& bytes) {
  std::vector<std::string> texts;
  std::stringstream stream(bytes);
  for (std::string text; std::getline(stream, text, '\0');) texts.push_back(text);
  return texts;
}

std::string variable_in(const std::vector<std::string>& environment, const std::string& name) {
  for (const std::string& entry : environment)
    if (entry.starts_with(name + "=")) return entry.substr(name.size() + 1);
  return "";
}

/// A process' number in its own space.
std::string own_number(pid_t number) {
  std::stringstream lines(text_of(proc(number, "status")));
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("NSpid:")) return line.substr(line.find_last_of("\t ") + 1);
  return std::to_string(number);
}

// -- starting -------------------------------------------------------------------------------------

/// A program with its arguments and where its output goes, made before a fork: after it nothing is
/// allocated.
class Command {
 public:
  Command(std::vector<std::string> words, fs::path output)
      : words_(std::move(words)), output_(std::move(output)) {
    for (std::string& word : words_) pointers_.push_back(word.data());
    pointers_.push_back(nullptr);
  }
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  [[noreturn]] void become() {
    ::setsid();
    const int input = ::open("/dev/null", O_RDONLY);
    const int output = ::open(output_.c_str(), O_CREAT | O_APPEND | O_WRONLY, 0600);
    ::dup2(input, 0);
    ::dup2(output, 1);
    ::dup2(output, 2);
    ::execv(pointers_[0], pointers_.data());
    ::_exit(127);
  }

 private:
  std::vector<std::string> words_;
  fs::path output_;
  std::vector<char*> pointers_;
};

/// A child that ends with the test.
pid_t start(Command& command) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  command.become();
}

/// Ends all that descends from this process. All stand still before the first dies, so that none can
/// tell of the death of another.
void end_descendants() {
  const pid_t self = ::getpid();
  std::size_t num_stopped = 0;
  for (bool are_new = true; are_new;) {
    const std::vector<pid_t> all = descendants_of(self);
    for (const pid_t number : all) ::kill(number, SIGSTOP);
    are_new = all.size() > num_stopped;
    num_stopped = all.size();
  }
  while (::waitpid(-1, nullptr, WNOHANG) >= 0 || errno == EINTR) {
    for (const pid_t number : descendants_of(self)) ::kill(number, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

/// The ancestor of all processes of a node: it starts slurmd, at once and on SIGUSR1, and ends with
/// all on SIGTERM or the end of the test.
/// ready   written to when it is set up; closed else
[[noreturn]] void be_root(Command& slurmd, bool has_space, int ready) {
  sigset_t signals;
  ::sigemptyset(&signals);
  for (const int number : {SIGCHLD, SIGUSR1, SIGTERM}) ::sigaddset(&signals, number);
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  if (has_space && (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
                    ::mount("proc", "/proc", "proc", 0, nullptr) != 0))
    ::_exit(1);
  if (::write(ready, "+", 1) != 1) ::_exit(1);
  ::close(ready);
  for (int number = SIGUSR1; number != SIGTERM; ::sigwait(&signals, &number)) {
    if (number == SIGUSR1 && ::fork() == 0) {
      ::sigprocmask(SIG_UNBLOCK, &signals, nullptr);
      slurmd.become();
    }
    while (::waitpid(-1, nullptr, WNOHANG) > 0) {
    }
  }
  end_descendants();
  ::_exit(0);
}

/// As fork(), into a new space of process numbers; -1 where that is not allowed.
pid_t fork_into_space() {
  return static_cast<pid_t>(::syscall(SYS_clone, CLONE_NEWPID | CLONE_NEWNS | SIGCHLD, 0, 0, 0, 0));
}

/// Ports that nobody listens on.
std::vector<int> free_ports(std::size_t count) {
  std::vector<int> sockets;
  std::vector<int> ports;
  for (std::size_t i = 0; i < count; ++i) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    sockets.push_back(::socket(AF_INET, SOCK_STREAM, 0));
    if (::bind(sockets.back(), reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
        ::getsockname(sockets.back(), reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no port is free on the loopback interface");
    ports.push_back(ntohs(address.sin_port));
  }
  for (const int socket : sockets) ::close(socket);
  return ports;
}

std::string host_name() {
  char name[256] = {};
  ::gethostname(name, sizeof name - 1);
  const std::string whole = name;
  return whole.substr(0, whole.find('.'));
}

fs::path make_folder() {
  fs::path parent = fs::temp_directory_path();
  if (parent.string().size() > kLongestFolder) parent = "/tmp";
  std::string name = (parent / "slurm-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw std::runtime_error(parent.string() + ": no folder can be made there");
  ::chmod(name.c_str(), 0755);  // munged refuses what others may write to
  return name;
}

void wait_for_end(pid_t child) {
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void kill_child(pid_t& child) {
  if (child <= 0) return;
  ::kill(child, SIGKILL);
  wait_for_end(child);
  child = 0;
}

bool holds_within(double timeout_s, const std::function<bool()>& condition) {
  const auto start = Clock::now();
  while (!condition()) {
    if (std::chrono::duration<double>(Clock::now() - start).count() > timeout_s) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

}  // namespace

std::string SlurmCluster::why_not() {
  if (::geteuid() != 0) return "a Slurm of one's own needs root";
  for (const char* name : {"munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol"})
    if (!find_daemon(name))
      return fmt::format("{} is not installed; scripts/packages.txt lists Slurm's packages", name);
  return "";
}

SlurmCluster::SlurmCluster(bool may_have_spaces)
    : folder_(make_folder()), has_spaces_(may_have_spaces) {
  ::setenv("SLURM_CONF", (folder_ / "slurm.conf").c_str(), 1);
  for (int i = 0; i < kMostStarts; ++i) {
    if (start_daemons()) return;
    const std::string said = logs();
    end_all();
    if (i + 1 < kMostStarts) continue;
    ::unsetenv("SLURM_CONF");
    fs::remove_all(folder_);
    throw std::runtime_error("no Slurm came up\n" + said);
  }
}

SlurmCluster::~SlurmCluster() {
  end_all();
  ::unsetenv("SLURM_CONF");
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void SlurmCluster::write_config() const {
  const std::vector<int> ports = free_ports(1 + kNodes.size());
  std::string text = fmt::format(
      "ClusterName=terracast\n"
      "SlurmctldHost={host}(127.0.0.1)\n"
      "SlurmctldPort={port}\n"
      "SlurmUser=root\n"
      "SlurmdUser=root\n"
      "AuthType=auth/munge\n"
      "CredType=cred/munge\n"
      // A task that was put back waits for its old credential's end: not two minutes, but 5 s.
      "AuthInfo=socket={folder}/munge.sock,cred_expire=5\n"
      "StateSaveLocation={folder}/state\n"
      "SlurmdSpoolDir={folder}/spool.%n\n"
      "SlurmctldPidFile={folder}/slurmctld.pid\n"
      "SlurmdPidFile={folder}/slurmd.%n.pid\n"
      "SlurmctldLogFile={folder}/slurmctld.log\n"
      "SlurmdLogFile={folder}/slurmd.%n.log\n"
      "JobCompType=jobcomp/filetxt\n"
      "JobCompLoc={folder}/ends.log\n"
      // Two nodes of more cores than the machine may have.
      "SlurmdParameters=config_overrides\n"
      "CommunicationParameters=NoAddrCache\n"
      // Nothing that needs cgroups, a database or a mail system.
      "ProctrackType=proctrack/linuxproc\n"
      "TaskPlugin=task/none\n"
      "JobAcctGatherType=jobacct_gather/none\n"
      "AccountingStorageType=accounting_storage/none\n"
      "SwitchType=switch/none\n"
      "MpiDefault=none\n"
      "MailProg=/bin/true\n"
      // Tasks start as soon as there is room.
      "SelectType=select/cons_tres\n"
      "SelectTypeParameters=CR_Core\n"
      "SchedulerType=sched/backfill\n"
      "SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,"
      "bf_interval=1\n"
      // Dead nodes are noticed in seconds, and are taken back when they return.
      "SlurmdTimeout=2\n"
      "MessageTimeout=5\n"
      "TCPTimeout=2\n"
      "BatchStartTimeout=10\n"
      "KillWait=2\n"
      "ReturnToService=2\n"
      "JobRequeue=1\n"
      "MinJobAge=3600\n"
      "MaxArraySize=1001\n",
      fmt::arg("host", host_name()), fmt::arg("port", ports[0]),
      fmt::arg("folder", folder_.string()));
  for (std::size_t i = 0; i < kNodes.size(); ++i)
    text += fmt::format(
        "NodeName={} NodeHostname={} NodeAddr=127.0.0.1 Port={} CPUs={} RealMemory={}\n", kNodes[i],
        host_name(), ports[1 + i], kCoresPerNode, kMemoryPerNode_mib);
  text += "PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n";
  std::ofstream(folder_ / "slurm.conf") << text;
}

bool SlurmCluster::start_daemons() {
  fs::create_directories(folder_ / "state");
  fs::remove(folder_ / "munge.sock");
  char key[128];
  if (::getrandom(key, sizeof key, 0) != sizeof key) return false;
  std::ofstream(folder_ / "munge.key", std::ios::binary).write(key, sizeof key);
  fs::permissions(folder_ / "munge.key", fs::perms::owner_read);
  write_config();
  const auto in_folder = [&](const char* option, const char* name) {
    return std::string(option) + (folder_ / name).string();
  };
  Command munged({find_daemon("munged")->string(), "--foreground", "--force", "--num-threads=2",
                  in_folder("--key-file=", "munge.key"), in_folder("--socket=", "munge.sock"),
                  in_folder("--pid-file=", "munged.pid"), in_folder("--seed-file=", "munged.seed")},
                 folder_ / "munged.log");
  munged_ = start(munged);
  if (!holds_within(20.0, [&] { return fs::exists(folder_ / "munge.sock"); })) return false;
  Command slurmctld({find_daemon("slurmctld")->string(), "-D", "-c", "-i", "-f",
                     (folder_ / "slurm.conf").string()},
                    folder_ / "slurmctld.out");
  slurmctld_ = start(slurmctld);
  for (const char* node : kNodes) roots_[node] = start_root(node);
  return holds_within(30.0, [&] {
    const ProgramResult nodes =
        run_command(find_daemon("sinfo")->string(), {"--noheader", "--Node", "--format=%T"});
    return nodes.status == 0 && nodes.output == "idle\nidle\n";
  });
}

pid_t SlurmCluster::start_root(const std::string& node) {
  Command slurmd(
      {find_daemon("slurmd")->string(), "-D", "-N", node, "-f", (folder_ / "slurm.conf").string()},
      folder_ / ("slurmd." + node + ".out"));
  for (;;) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe can be made");
    const pid_t root = has_spaces_ ? fork_into_space() : ::fork();
    if (root == 0) be_root(slurmd, has_spaces_, ends[1]);
    ::close(ends[1]);
    char sign = 0;
    const bool is_ready = root > 0 && ::read(ends[0], &sign, 1) == 1;
    ::close(ends[0]);
    if (is_ready) return root;
    if (root > 0) wait_for_end(root);
    if (!has_spaces_) throw std::runtime_error("no process can be started for a node");
    has_spaces_ = false;
  }
}

void SlurmCluster::end_root(const std::string& node) {
  const auto found = roots_.find(node);
  if (found == roots_.end()) return;
  // The end of the first process of a space is the end of all of them.
  ::kill(found->second, has_spaces_ ? SIGKILL : SIGTERM);
  wait_for_end(found->second);
  roots_.erase(found);
}

void SlurmCluster::end_all() {
  for (const char* node : kNodes) end_root(node);
  kill_child(slurmctld_);
  kill_child(munged_);
}

void SlurmCluster::kill_node(const std::string& node) { end_root(node); }

void SlurmCluster::kill_slurmd(const std::string& node) {
  const auto slurmd_of = [&]() -> pid_t {
    for (const pid_t number : descendants_of(roots_.at(node)))
      if (text_of(proc(number, "comm")) == "slurmd\n") return number;
    return 0;
  };
  const pid_t slurmd = slurmd_of();
  if (slurmd == 0) throw std::runtime_error(node + " has no slurmd");
  ::kill(slurmd, SIGKILL);
  wait_until("slurmd of " + node + " is gone", [&] { return slurmd_of() == 0; });
}

void SlurmCluster::start_node(const std::string& node) {
  if (const auto root = roots_.find(node); root != roots_.end())
    ::kill(root->second, SIGUSR1);
  else
    roots_[node] = start_root(node);
  wait_until(node + " is back", [&] {
    const std::string state = command("sinfo", {"--noheader", "--nodes=" + node, "--format=%T"});
    return state == "idle\n" || state == "mixed\n" || state == "allocated\n";
  });
}

std::string SlurmCluster::command(const std::string& program,
                                  const std::vector<std::string>& arguments) const {
  const auto found = find_daemon(program);
  if (!found) throw std::runtime_error(program + " is not installed");
  ProgramResult result = run_command(found->string(), arguments);
  // On a busy machine the controller may be too late with its answer, or drop the connection; asking
  // changes nothing.
  const bool only_asks = program == "squeue" || program == "sinfo";
  constexpr int kMostRepeats = 4;
  for (int repeat = 0; repeat < kMostRepeats && only_asks && result.status != 0 &&
                       (result.output.find("timed out") != std::string::npos ||
                        result.output.find("socket error") != std::string::npos);
       ++repeat)
    result = run_command(found->string(), arguments);
  if (result.status != 0)
    throw std::runtime_error(
        fmt::format("{} ended with status {}: {}", program, result.status, result.output));
  return result.output;
}

std::vector<SlurmCluster::Task> SlurmCluster::tasks() const {
  std::vector<Task> all;
  std::stringstream lines(
      command("squeue", {"--noheader", "--states=all", "--format=%F|%K|%T|%N"}));
  for (std::string line; std::getline(lines, line);) {
    std::stringstream fields(line);
    Task task;
    std::string index;
    std::getline(fields, task.array, '|');
    std::getline(fields, index, '|');
    std::getline(fields, task.state, '|');
    std::getline(fields, task.node, '|');
    if (index.empty() || index.find_first_not_of("0123456789") != std::string::npos) continue;
    task.index = std::stoi(index);
    all.push_back(task);
  }
  return all;
}

bool SlurmCluster::is_empty() const {
  // Without --states, of all that is not over.
  return command("squeue", {"--noheader"}).empty();
}

int SlurmCluster::num_ends(const std::string& state) const {
  int count = 0;
  std::stringstream lines(text_of(folder_ / "ends.log"));
  for (std::string line; std::getline(lines, line);)
    count += line.find("JobState=" + state + " ") != std::string::npos ? 1 : 0;
  return count;
}

std::vector<SlurmCluster::Process> SlurmCluster::processes() const {
  std::vector<Process> all;
  for (const pid_t number : all_processes()) {
    const std::vector<std::string> environment = texts_in(text_of(proc(number, "environ")));
    const std::string index = variable_in(environment, "SLURM_ARRAY_TASK_ID");
    if (index.empty() ||
        variable_in(environment, "SLURM_CONF") != (folder_ / "slurm.conf").string())
      continue;
    const std::vector<std::string> record = record_of(number);
    if (record.size() < 20 || record[0] == "Z") continue;
    std::string command;
    for (const std::string& word : texts_in(text_of(proc(number, "cmdline"))))
      command += word + " ";
    const std::string restarts = variable_in(environment, "SLURM_RESTART_COUNT");
    all.push_back({.number = number,
                   .own = own_number(number) + "-" + record[19],
                   .command = command,
                   .node = variable_in(environment, "SLURMD_NODENAME"),
                   .array = variable_in(environment, "SLURM_ARRAY_JOB_ID"),
                   .index = std::stoi(index),
                   .num_restarts = restarts.empty() ? 0 : std::stoi(restarts)});
  }
  return all;
}

void SlurmCluster::wait_until(const std::string& what, const std::function<bool()>& condition,
                              double timeout_s) const {
  if (holds_within(timeout_s, condition)) return;
  throw std::runtime_error(
      fmt::format("in {} s it did not come to this: {}\n{}", timeout_s, what, logs()));
}

std::string SlurmCluster::logs() const {
  constexpr std::size_t kShown = 3000;
  std::string text;
  if (const auto squeue = find_daemon("squeue"); squeue && slurmctld_ > 0)
    text = run_command(squeue->string(), {"--states=all"}, {.timeout_s = 10.0}).output;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::string extension = entry.path().extension();
    if (extension != ".log" && extension != ".out") continue;
    const std::string log = text_of(entry.path());
    text += fmt::format("-- {}\n{}\n", entry.path().filename().string(),
                        log.substr(log.size() - std::min(log.size(), kShown)));
  }
  return text;
}

}  // namespace terracast::test

#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace terracast::test {

/// A Slurm of two nodes on this machine, for one test: a munged, a slurmctld and two slurmd with a
/// key, ports and a folder of their own. Each node has two cores and, where the system allows it, its
/// own space of process numbers, as if it were another machine. All that was started, and all that
/// runs on it, ends with this object, and with the process of the test, however that ends.
/// threads   one at a time, from the thread that made it
class SlurmCluster {
 public:
  static constexpr std::array kNodes = {"n1", "n2"};

  /// Why there can be none here; empty: there can.
  static std::string why_not();

  /// Returns when both nodes are idle. Sets SLURM_CONF, by which Slurm's commands find it.
  /// may_have_spaces   false: nodes are but trees of processes, as where the system allows no more
  /// throws            std::runtime_error: with what the daemons said
  explicit SlurmCluster(bool may_have_spaces = true);
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// The death of a machine: SIGKILL for its slurmd and all that runs on it.
  void kill_node(const std::string& node);
  /// The death of its slurmd alone: tasks run on, but Slurm cannot see them.
  void kill_slurmd(const std::string& node);
  /// Starts a node, or its slurmd, again; returns when it is not down for Slurm.
  void start_node(const std::string& node);

  /// What a command of Slurm says; squeue and sinfo are asked again where Slurm is too late with its answer.
  /// throws   std::runtime_error: it failed
  std::string command(const std::string& program, const std::vector<std::string>& arguments) const;

  /// A task of an array, as squeue tells.
  struct Task {
    std::string array;
    int index = 0;
    std::string state;  ///< "PENDING", "RUNNING", "COMPLETED", …
    std::string node;   ///< empty: none yet

    std::string name() const { return array + "_" + std::to_string(index); }
  };
  /// All tasks since the start; those that wait and were not split off yet are none.
  std::vector<Task> tasks() const;
  /// Whether nothing waits and nothing runs.
  bool is_empty() const;
  /// How many jobs ended so, or were begun again after they had, as "NODE_FAIL".
  int num_ends(const std::string& state) const;

  /// A process that runs in a task, as the kernel tells: Slurm need not know of it.
  struct Process {
    pid_t number = 0;     ///< as seen from the test
    std::string own;      ///< its number as it sees it itself, and when it began: "17-40021"
    std::string command;  ///< with its arguments, by spaces
    std::string node;
    std::string array;
    int index = 0;
    int num_restarts = 0;

    std::string task() const { return array + "_" + std::to_string(index); }
  };
  std::vector<Process> processes() const;

  /// Waits until a condition holds.
  /// what     it is, for the message
  /// throws   std::runtime_error: it does not within the time; says how the tasks stand
  void wait_until(const std::string& what, const std::function<bool()>& condition,
                  double timeout_s = 600.0) const;

 private:
  bool start_daemons();
  void write_config() const;
  pid_t start_root(const std::string& node);
  void end_root(const std::string& node);
  void end_all();
  std::string logs() const;

  std::filesystem::path folder_;
  bool has_spaces_;
  pid_t munged_ = 0;
  pid_t slurmctld_ = 0;
  std::map<std::string, pid_t> roots_;  ///< of each node that lives: the ancestor of its processes
};

}  // namespace terracast::test

/// Skips the test, saying why, where no cluster can be brought up.
#define TERRACAST_NEEDS_SLURM()                                                               \
  if (const std::string reason = ::terracast::test::SlurmCluster::why_not(); !reason.empty()) \
  GTEST_SKIP() << "skipped: no Slurm: " << reason

#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

/// A batch job as its user sees it: commands, folders, files.
namespace terracast::test {

/// The shards of a stage come into being after all of the earlier stages'.
inline const std::vector<std::string> kBatchStages = {"tile", "render", "export", "validate",
                                                      "merge"};

/// A tiny batch as it stands before each of its stages and after the last, each in a folder of its
/// own, for copying. Shared by all tests (made_once).
class BatchSnapshots {
 public:
  /// cost   the whole batch, once for a program; the test fails where it does not run
  BatchSnapshots();

  /// num_stages   done: 0 for a job that is planned, kBatchStages.size() for one that is complete
  const std::filesystem::path& after(std::size_t num_stages) const { return jobs_.at(num_stages); }
  const std::filesystem::path& complete() const { return jobs_.back(); }
  /// Seconds that a stage took.
  double duration_s(std::size_t stage) const { return durations_s_.at(stage); }

 private:
  std::vector<std::filesystem::path> jobs_;
  std::vector<double> durations_s_;
};

/// With the links in it.
void copy_job(const std::filesystem::path& job, const std::filesystem::path& copy);

/// What the files of a job are, by the part of their path that tells.
struct JobFiles {
  std::string name;       ///< "tile", "frame record", "plan"
  std::string folder;     ///< below the job's
  std::string substring;  ///< of the path below that, "" for any
  std::string ending;
};
/// Every kind of file that a job holds while nobody works on it.
const std::vector<JobFiles>& kinds_of_job_files();
/// Files of a kind, relative to the job's folder, sorted.
std::vector<std::string> job_files(const std::filesystem::path& job, const JobFiles& kind);

enum class Damage { Flip, Truncate, Delete, Append };
inline constexpr Damage kDamages[] = {Damage::Flip, Damage::Truncate, Damage::Delete,
                                      Damage::Append};
std::string damage_name(Damage damage);
/// Damages a file behind its writer's back: in place, as a failing disk does.
/// random   chooses the byte or the length
/// returns  whether it is another file now
bool do_damage(const std::filesystem::path& file, Damage damage, std::uint64_t random);

/// What is wrong with a job that ought to be complete, by comparison with one that is: the dataset's
/// files and `sha256sum -c`, the records of shards, what dead processes left, what status says.
/// returns   a line each; none: all is right
std::vector<std::string> faults_of_complete_job(const std::filesystem::path& job,
                                                const std::filesystem::path& complete);

/// The first difference between two jobs' datasets; empty: none.
std::string dataset_difference(const std::filesystem::path& job,
                               const std::filesystem::path& complete);

}  // namespace terracast::test

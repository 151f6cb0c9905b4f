#include "batch/run_files.h"

#include <set>
#include <vector>

#include "core/hash.h"
#include "core/plugin_rows.h"
#include "job/job.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// Collects the files that a description names.
class FileLister final : public core::SchemaVisitor {
 public:
  std::vector<fs::path> files;

 private:
  void visit_value(std::string_view, core::ValueRef value, std::string_view,
                   const core::Constraint&) override {
    if (auto* const* path = std::get_if<core::Path*>(&value)) add(**path);
    if (auto* const* paths = std::get_if<std::vector<core::Path>*>(&value))
      for (const core::Path& path : **paths) add(path);
  }
  bool begin_section(std::string_view, std::string_view) override { return true; }
  void end_section() override {}
  std::size_t begin_list(std::string_view, std::string_view, std::size_t current_size) override {
    return current_size;
  }
  void end_list() override {}
  void begin_item(std::size_t) override {}
  void end_item() override {}
  void add(const core::Path& path) {
    if (!path.empty()) files.push_back(path.resolved);
  }
};

std::vector<fs::path> flight_files(const job::RunConfig& config) {
  FileLister lister;
  for (geo::TrajectoryOptions trajectory : config.trajectories) trajectory.describe(lister);
  return lister.files;
}

}  // namespace

std::string hash_of_path(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) return core::content_hash_of_file(path);
  std::set<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(path, ignored))
    if (entry.is_regular_file(ignored)) files.insert(entry.path());
  if (files.empty()) return core::content_hash(path.string());
  std::string text;
  for (const fs::path& file : files)
    text += file.lexically_relative(path).string() + " " + core::content_hash_of_file(file) + "\n";
  return core::content_hash(text);
}

std::string run_key(const std::string& world, const std::string& edits,
                    const job::RunConfig& config,
                    const std::function<std::string(const fs::path&)>& hash_of) {
  std::string text = world + edits + job::toml_of_captures(config);
  for (const fs::path& file : flight_files(config)) text += hash_of(file);
  return core::content_hash(text);
}

void check_flight_files(const PlannedRun& run, const std::string& world,
                        const job::RunConfig& config) {
  const std::vector<fs::path> files = flight_files(config);
  const auto plugins = core::plugins_named_in(job::toml_of_captures(config));
  if (files.empty() && plugins.empty()) return;
  if (run_key(world, run.edits, config, hash_of_path) == run.key) return;
  if (files.empty())
    fail(ErrorKind::Input,
         "a plug-in of {} has changed since its plan was made ({}); restore it, or take the change "
         "up with `terracast batch plan --update`",
         run.name, core::plugin_marks(job::toml_of_captures(config)));
  std::string names;
  for (const fs::path& file : files) names += (names.empty() ? "" : ", ") + file.string();
  fail(ErrorKind::Input,
       "{}: {} of {} is another than when the plan was made; bring it back, or take the change up "
       "with `terracast batch plan --update`",
       names, files.size() == 1 ? "this flight" : "one of these flights", run.name);
}

}  // namespace terracast::batch

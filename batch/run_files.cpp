#include "batch/run_files.h"

#include <set>
#include <vector>

#include "core/hash.h"
#include "core/plugin_rows.h"
#include "core/schema_writer.h"
#include "job/job.h"
#include "labels/label.h"
#include "validate/report.h"

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

/// named   text that names the kinds of plug-ins that take part
[[noreturn]] void fail_changed_plugin(const PlannedRun& run, const std::string& named) {
  std::string now;
  for (const core::Plugin* plugin : core::plugins_named_in(named))
    now += fmt::format("{}{} {}, {}", now.empty() ? "" : "; ", plugin->name, plugin->version,
                       plugin->file.string());
  fail(ErrorKind::Input,
       "a plug-in of {} is another than when the plan was made (now: {}); bring it back, or take "
       "the "
       "change up with `terracast batch plan --update`",
       run.name, now.empty() ? "none is loaded" : now);
}

std::string text_of_format(const job::RunConfig& config, const exporters::ExportOptions& chosen,
                           double within_m) {
  std::string text = core::toml_text(chosen) + fmt::format("\nwithin_m {}", within_m);
  for (const labels::LabelOptions& labels : config.labels) text += "\n" + core::toml_text(labels);
  return text;
}

std::string short_hash(const std::string& text) { return core::content_hash(text).substr(0, 12); }

}  // namespace

std::string checks_key(const job::RunConfig& config) {
  return short_hash(core::toml_text(config.validation) +
                    core::plugin_marks(validate::names_of_checks()));
}

std::string format_key(const job::RunConfig& config, const exporters::ExportOptions& chosen,
                       double within_m) {
  const std::string text = text_of_format(config, chosen, within_m);
  return short_hash(text + core::plugin_marks(text));
}

void check_plugins_of_format(const PlannedRun& run, const PlannedFormat& format,
                             const job::RunConfig& config, double within_m) {
  for (const auto& chosen : config.exports)
    if (chosen.format == format.name && format_key(config, chosen, within_m) != format.key)
      fail_changed_plugin(run, text_of_format(config, chosen, within_m));
}

void check_plugins_of_checks(const PlannedRun& run, const job::RunConfig& config) {
  if (checks_key(config) != run.checks) fail_changed_plugin(run, validate::names_of_checks());
}

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
  if (files.empty()) fail_changed_plugin(run, job::toml_of_captures(config));
  std::string names;
  for (const fs::path& file : files) names += (names.empty() ? "" : ", ") + file.string();
  fail(ErrorKind::Input,
       "{}: {} of {} is another than when the plan was made; bring it back, or take the change up "
       "with `terracast batch plan --update`",
       names, files.size() == 1 ? "this flight" : "one of these flights", run.name);
}

}  // namespace terracast::batch

#include "batch/run_files.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <vector>

#include "core/hash.h"
#include "core/plugin_rows.h"
#include "core/schema_writer.h"
#include "job/job.h"
#include "labels/label.h"
#include "validate/check.h"

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
       "a plug-in of {} is not the one that its plan was made with (now: {}); bring that one back, "
       "or take the change up with `terracast batch plan --update`",
       run.name, now.empty() ? "none is loaded" : now);
}

std::vector<std::string> names_of(const std::vector<const core::Plugin*>& plugins) {
  std::vector<std::string> names;
  for (const core::Plugin* plugin : plugins) names.push_back(plugin->name);
  return names;
}

std::string text_of_format(const job::RunConfig& config, const exporters::ExportOptions& chosen,
                           double within_m) {
  std::string text = core::toml_text(chosen) + fmt::format("\nwithin_m {}", within_m);
  for (const labels::LabelOptions& labels : config.labels) text += "\n" + core::toml_text(labels);
  return text;
}

std::string short_hash(const std::string& text) { return core::content_hash(text).substr(0, 12); }

constexpr char kBeforePlugins = '+';

/// The hash of a text, then that of the plug-ins whose kinds `named` names, where there are any.
std::string key_of(const std::string& text, const std::string& named) {
  const std::string marks = core::plugin_marks(named);
  return short_hash(text) + (marks.empty() ? "" : kBeforePlugins + short_hash(marks));
}

/// The plug-ins' part of such a key.
std::string_view plugins_in(std::string_view key) {
  return key.substr(std::min(key.find(kBeforePlugins), key.size()));
}

}  // namespace

std::string checks_key(const job::RunConfig& config) {
  return key_of(core::toml_text(config.validation), validate::names_of_checks());
}

std::string format_key(const job::RunConfig& config, const exporters::ExportOptions& chosen,
                       double within_m) {
  const std::string text = text_of_format(config, chosen, within_m);
  return key_of(text, text);
}

void check_plugins_of_format(const PlannedRun& run, std::size_t format,
                             const job::RunConfig& config, double within_m) {
  const exporters::ExportOptions& chosen = config.exports.at(format);
  if (plugins_in(format_key(config, chosen, within_m)) != plugins_in(run.formats[format].key))
    fail_changed_plugin(run, text_of_format(config, chosen, within_m));
}

void check_plugins_of_checks(const PlannedRun& run, const job::RunConfig& config) {
  if (plugins_in(checks_key(config)) != plugins_in(run.checks))
    fail_changed_plugin(run, validate::names_of_checks());
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
       "{}: {} of {}{} is not the one that the plan was made with; bring it back, or take the "
       "change up with `terracast batch plan --update`",
       names, files.size() == 1 ? "this flight" : "one of these flights", run.name,
       plugins.empty() ? std::string()
                       : fmt::format(", or plug-in {}", fmt::join(names_of(plugins), ", ")));
}

}  // namespace terracast::batch

#include "batch/description.h"

namespace terracast::batch {
namespace {

SweepOptions sweep_of(const core::TomlDocument& document) {
  SweepOptions options;
  document.read_section("sweep", options);
  return options;
}

}  // namespace

Description::Description(core::TomlDocument document)
    : document_(std::move(document)), sweep_(sweep_of(document_)) {}

Description Description::load(const std::filesystem::path& file,
                              const std::vector<std::string>& sets) {
  return core::with_context([&] { return Description(core::TomlDocument::load(file, sets)); },
                            fmt::format("reading the config {}", file.string()));
}

Description Description::load(const core::ConfigInputs& inputs) {
  return core::with_context([&] { return Description(core::TomlDocument::load(inputs)); },
                            fmt::format("reading the plan's config, {}", inputs.file.string()));
}

job::RunConfig Description::run_config(std::int64_t index) const {
  const RunChanges run = sweep_.run(index);
  return core::with_context(
      [&] {
        job::RunConfig config;
        document_.with(run.changes, "sweep").read(config);
        return config;
      },
      run.changes.empty() ? "reading the run's config"
                          : fmt::format("reading run {} of the sweep: {}", index, run.text()));
}

void SweepSection::describe(core::SchemaVisitor& visit) {
  visit.section("sweep", sweep, "The runs that a dataset is made of; for `terracast batch`.");
}

}  // namespace terracast::batch

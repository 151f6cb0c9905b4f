#include "batch/description.h"

namespace terracast::batch {
namespace {

template <class Options>
Options section_of(const core::TomlDocument& document, const char* name) {
  Options options;
  document.read_section(name, options);
  return options;
}

}  // namespace

Description::Description(core::TomlDocument document)
    : document_(std::move(document)),
      sweep_(section_of<SweepOptions>(document_, "sweep")),
      dataset_(section_of<DatasetOptions>(document_, "dataset")) {
  if (!document_.has("dataset")) dataset_.publication.name = run_config(0).name;
}

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
        document_.with(run.changes, {"sweep", "dataset"}).read(config);
        job::resolve_flags(config);
        return config;
      },
      run.changes.empty() ? "reading the run's config"
                          : fmt::format("reading run {} of the sweep: {}", index, run.text()));
}

void DescriptionSections::describe(core::SchemaVisitor& visit) {
  visit.section("sweep", sweep, "The runs that a dataset is made of; for `terracast batch`.");
  visit.section("dataset", dataset,
                "What the merged dataset says of itself, and how it is divided; for `terracast "
                "batch`.");
}

}  // namespace terracast::batch

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>

#include "core/atomic_file.h"
#include "tests/jobs/written_job.h"

/// Writes jobs that are right by construction, drawn by seed over all that a config can say, to see whether `validate`
/// calls any of them wrong.
namespace terracast::test {

namespace {

namespace fs = std::filesystem;

/// Jobs of one world, as the description of a batch.
void write_batch(const std::vector<GeneratedJob>& jobs, const std::string& name,
                 const fs::path& out, const std::string& data) {
  std::string text = fmt::format(
      "name = \"{}\"\ndata = \"{}\"\nworld = \"worlds/{}.toml\"\n\n[sweep]\n\n[[sweep.list]]\nkeys "
      "= [\"name\"",
      name, data, jobs.front().world->name);
  for (const std::string& key : jobs.front().keys) text += fmt::format(", \"{}\"", key);
  text += "]\nrows = [\n";
  for (const GeneratedJob& job : jobs) {
    std::vector<std::string> values{fmt::format("\"job{}\"", folder_name(job.seed))};
    for (const std::string& value : job.values)
      values.push_back(replaced(value, "@", folder_name(job.seed) + "/"));
    text += fmt::format("  [{}],\n", fmt::join(values, ", "));
  }
  core::write_file(out / (name + ".toml"), text + "]\n");
}

int run(int argc, char** argv) {
  CLI::App app(
      "Writes jobs that are drawn by seed and right by construction: a folder each, and batches of "
      "those that share "
      "a world.");
  std::uint64_t first = 1, count = 20, most = 40;
  std::string out_name, data, configs = TERRACAST_SOURCE_DIR "/configs";
  app.add_option("--first", first, "The first seed.")->capture_default_str();
  app.add_option("--count", count, "How many seeds.")->capture_default_str();
  app.add_option("--most", most, "Jobs of a batch at most.")->capture_default_str();
  app.add_option("--data", data,
                 "Folder of source data; without it seeds of worlds of data are left out.");
  JobExtent extent = JobExtent::Whole;
  app.add_flag_callback(
      "--small", [&] { extent = JobExtent::Small; },
      "Worlds of formulas alone, a tenth of the rays and ten frames at most.");
  app.add_flag_callback(
      "--quick", [&] { extent = JobExtent::Quick; },
      "The same, three hundredths of the rays and five frames at most.");
  app.add_option("--out", out_name, "Folder for jobs, worlds and batches.")->required();
  CLI11_PARSE(app, argc, argv);
  const fs::path out = fs::absolute(out_name);
  const std::string data_folder = data.empty() ? "" : fs::absolute(data).string();
  std::map<std::string, std::vector<GeneratedJob>> by_world;
  std::uint64_t num_left_out = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    GeneratedJob job = generate_job(seed, {.has_data = !data.empty(), .extent = extent});
    if (job.world == nullptr) {
      ++num_left_out;
      continue;
    }
    write_world(*job.world, out, configs);
    write_job(job, out, data_folder);
    by_world[job.world->name].push_back(std::move(job));
  }
  std::uint64_t num_batches = 0;
  for (const auto& [world, jobs] : by_world)
    for (std::size_t from = 0; from < jobs.size(); from += most) {
      const std::size_t to = std::min(from + static_cast<std::size_t>(most), jobs.size());
      write_batch({jobs.begin() + static_cast<std::ptrdiff_t>(from),
                   jobs.begin() + static_cast<std::ptrdiff_t>(to)},
                  fmt::format("{}-{}", world, from / most), out, data_folder);
      ++num_batches;
    }
  fmt::print("{} jobs in {} batches; {} left out, whose worlds need --data or are no formulas\n",
             count - num_left_out, num_batches, num_left_out);
  return 0;
}

}  // namespace

}  // namespace terracast::test

int main(int argc, char** argv) {
  try {
    return terracast::test::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}

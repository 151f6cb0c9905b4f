#include "tests/jobs/written_job.h"

#include <fmt/format.h>

#include "core/atomic_file.h"

namespace terracast::test {

namespace fs = std::filesystem;

std::string folder_name(std::uint64_t seed) { return fmt::format("{:07}", seed); }

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

void write_world(const JobWorld& world, const fs::path& out, const std::string& configs) {
  fs::create_directories(out / "worlds");
  core::write_file(out / "worlds" / (world.name + ".toml"),
                   replaced(world.text, "@CONFIGS@", configs));
}

void write_job(const GeneratedJob& job, const fs::path& out, const std::string& data) {
  const fs::path folder = out / folder_name(job.seed);
  fs::create_directories(folder);
  for (const JobFile& file : job.files) core::write_file(folder / file.name, file.text);
  std::string text = fmt::format("name = \"job{}\"\ndata = \"{}\"\nworld = \"../worlds/{}.toml\"\n",
                                 folder_name(job.seed), data, job.world->name);
  for (std::size_t i = 0; i < job.keys.size(); ++i)
    text += fmt::format("{} = {}\n", job.keys[i], replaced(job.values[i], "@", ""));
  core::write_file(folder / "job.toml", text);
}

}  // namespace terracast::test

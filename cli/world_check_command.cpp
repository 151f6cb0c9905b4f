#include "cli/world_check_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "cli/threads_option.h"
#include "core/log.h"
#include "core/parallel.h"
#include "validate/world_check/world_check.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path store, report;
  int num_threads = 0;
  bool quiet = false;
};

int run(const Arguments& args) {
  const auto store = world::TileStore::open(args.store);
  const core::Log log("world", args.quiet ? core::LogLevel::Warn : core::LogLevel::Info);
  const core::ThreadLimit limit(args.num_threads);
  const world_check::WorldFaults faults = world_check::check_world(
      store, {.log = log, .num_threads = args.num_threads, .events_file = {}});
  if (!args.report.empty()) world_check::json_from(faults, store.manifest()).write(args.report);
  fmt::print("{}{}\n", world_check::table_of(faults, store.manifest()),
             faults.is_right() ? "nothing is wrong" : "THE WORLD IS WRONG");
  return faults.is_right() ? 0 : 1;
}

}  // namespace

void add_world_check_command(CLI::App& world_command, int& status) {
  auto args = std::make_shared<Arguments>();
  auto* command = world_command.add_subcommand(
      "check", "Look for what is wrong in a world: meshes, borders of tiles, things that float.");
  command->add_option("STORE", args->store, "Folder of the world.")->required();
  command->add_option("--report", args->report, "A JSON file for the results.");
  add_threads_option(*command, args->num_threads);
  command->add_flag("-q,--quiet", args->quiet, "Warnings only.");
  command->callback([args, &status] { status = run(*args); });
}

}  // namespace terracast::cli

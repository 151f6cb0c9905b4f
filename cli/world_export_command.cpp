#include "cli/world_export_command.h"

#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "cli/threads_option.h"
#include "cli/within.h"
#include "core/error.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/registry.h"
#include "export/world/world_format.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

struct Arguments {
  fs::path store, destination;
  std::string region, format;
  double spacing_m = 0.0;
  std::optional<double> texel_m;
  int num_threads = 0;
  bool quiet = false;
};

int run(const Arguments& args) {
  const auto store = world::TileStore::open(args.store);
  const world_export::WorldFormatInfo& format =
      core::find_registered(world_export::world_formats(), "format of worlds", args.format);
  if (!format.suffix.empty() && args.destination.extension() != format.suffix)
    fail(ErrorKind::Usage, "--output {}: {} is written to a file whose name ends in {}",
         args.destination.string(), format.name, format.suffix);
  if (args.texel_m && std::isnan(*args.texel_m))
    fail(ErrorKind::Usage, "--texel: give metres, or 0 for no pictures");
  const core::Log log("world", args.quiet ? core::LogLevel::Warn : core::LogLevel::Info);
  const core::ThreadLimit limit(args.num_threads);
  const core::Context context{.log = log, .num_threads = args.num_threads, .events_file = {}};
  const double finest_m = std::exp2(store.manifest().finest_level);
  world_export::export_region(format,
                              {.store = store,
                               .region = world_export::region_from_text(args.region),
                               .finest_spacing_m = args.spacing_m > 0.0 ? args.spacing_m : finest_m,
                               .texel_m = args.texel_m,
                               .destination = args.destination,
                               .context = context});
  log.info("{}: written", args.destination.string());
  return 0;
}

}  // namespace

void add_world_export_command(CLI::App& world_command, int& status) {
  auto args = std::make_shared<Arguments>();
  auto* command =
      world_command.add_subcommand("export", "Write a part of a world for other programs.");
  command->add_option("STORE", args->store, "Folder of the world.")->required();
  command
      ->add_option("--region", args->region,
                   "What part: SOUTH,WEST,NORTH,EAST in degrees, such as 42.50,1.51,42.52,1.54.")
      ->required();
  const auto formats = core::registry_names(world_export::world_formats());
  command->add_option("--format", args->format, fmt::format("One of {}.", fmt::join(formats, ", ")))
      ->required();
  command->add_option("-o,--output", args->destination, "The file to write; of 3dtiles a folder.")
      ->required();
  command
      ->add_option("--spacing", args->spacing_m,
                   "Of the finest terrain samples, m; left out: as fine as the world is there.")
      ->check(within(0.125, 16384.0));
  command
      ->add_option(
          "--texel", args->texel_m,
          "Of the pictures of the ground, m a pixel on the finest tiles; 0: no pictures and no "
          "textures, of geotiff no _albedo.tif; left out: 1024 pixels a tile, of 3dtiles 512. "
          "Otherwise geotiff and vdb have no use for it.")
      ->check(within(0.0, 16384.0));
  add_threads_option(*command, args->num_threads);
  command->add_flag("-q,--quiet", args->quiet, "Warnings only.");
  command->callback([args, &status] { status = run(*args); });
}

}  // namespace terracast::cli

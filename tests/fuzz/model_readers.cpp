// Models of things, lists of their places, legends of land cover.

#include <string>

#include "tests/fuzz/scratch.h"
#include "tests/fuzz/small_world.h"
#include "tiler/land_cover/legend.h"
#include "tiler/objects/model_file.h"
#include "tiler/objects/placement_list.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;

/// Reads the model that the part without a name is, with the other parts as the files beside it.
void read_model(const std::string& name, Bytes input) {
  const fs::path folder = fresh_folder();
  for (const Part& part : parts_of(input)) {
    if (part.name.empty())
      write_bytes(folder / name, part.bytes);
    else if (is_plain_name(part.name) && part.name != name)
      write_bytes(folder / part.name, part.bytes);
  }
  tiler::ModelOptions options;
  options.name = "thing";
  options.file = {.written = name, .resolved = folder / name};
  std::uint64_t texture_bytes_left = 1 << 24;
  tiler::read_model(options, texture_bytes_left);
}

}  // namespace

void fuzz_model_gltf(Bytes input) { read_model("thing.gltf", input); }
void fuzz_model_obj(Bytes input) { read_model("thing.obj", input); }
void fuzz_model_ply(Bytes input) { read_model("thing.ply", input); }
/// One file: its own chunks are its parts.
void fuzz_model_glb(Bytes input) {
  tiler::ModelOptions options;
  options.name = "thing";
  options.file = {.written = "thing.glb", .resolved = put("thing.glb", input)};
  std::uint64_t texture_bytes_left = 1 << 24;
  tiler::read_model(options, texture_bytes_left);
}

void fuzz_placements(Bytes input) {
  const core::Path file = {.written = "things.csv", .resolved = put("things.csv", input)};
  const SmallWorld world;
  tiler::read_placements(
      file,
      [](std::string_view name) {
        return name == "tree" ? std::optional<std::uint32_t>(0) : std::nullopt;
      },
      world.inputs());
}

/// A line a class: "10 = forest".
void fuzz_legend(Bytes input) {
  std::vector<std::string> classes(1);
  for (const char c : text_of(input)) {
    if (c == '\n')
      classes.emplace_back();
    else
      classes.back().push_back(c);
  }
  tiler::make_legend("worldcover", classes);
}

}  // namespace terracast::fuzz

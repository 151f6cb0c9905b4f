#include "tiler/objects/model_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/semantic_class.h"
#include "tiler/objects/model_builder.h"
#include "tiler/objects/model_folder.h"
#include "tiler/objects/model_gltf.h"
#include "tiler/objects/model_gltf_names.h"
#include "tiler/objects/model_mtl.h"
#include "tiler/objects/model_obj.h"
#include "tiler/objects/model_ply.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

std::string kind_of(const std::filesystem::path& file) {
  std::string kind = file.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return kind;
}

Model read(const ModelOptions& options, std::uint64_t& texture_bytes_left) {
  const std::filesystem::path& file = options.file.resolved;
  const std::string name = options.file.written;
  const std::string kind = kind_of(file);
  if (kind != ".gltf" && kind != ".glb" && kind != ".obj" && kind != ".ply")
    fail(ErrorKind::Config, "{}: models are .gltf, .glb, .obj or .ply", name);
  ModelFolder folder(file, name);
  const std::vector<std::byte> bytes = folder.read(file, name);
  if (bytes.empty())
    fail(ErrorKind::Input, "{}: is empty, a file of 0 bytes; fetch or write it again", name);
  ModelScene scene = kind == ".obj"   ? read_obj(bytes, folder)
                     : kind == ".ply" ? read_ply(bytes, folder)
                                      : read_gltf(bytes, folder);
  return ModelBuilder(options, folder, texture_bytes_left).build(std::move(scene));
}

}  // namespace

void ModelOptions::describe(core::SchemaVisitor& visit) {
  std::vector<std::string> classes;
  for (const std::string_view known : core::semantic_class_names()) classes.emplace_back(known);
  visit.key("name", name, "By which lists name it.", core::required());
  visit.key("file", file,
            "A .gltf or .glb (glTF 2), .obj or .ply; what it names lies in its folder.");
  visit.key("class", semantic_class, "What it is.", core::one_of(classes));
  visit.key("up", up, "Its upward axis. y: z is its front, as in glTF; z: x is its front.",
            core::one_of({"y", "z"}));
  visit.key(
      "origin", origin,
      "What stands at a place: foot, the middle of its lowest level; or the model's own origin.",
      core::one_of({"foot", "model"}));
  visit.key("unit_m", unit_m, "Length of its unit.", core::between(1e-4, 1e3));
  visit.key("yaw_deg", yaw_deg,
            "By which it is turned anticlockwise about up, so that its front is forward.",
            core::between(-360.0, 360.0));
}

void ModelOptions::validate() const {
  if (name.empty()) fail(ErrorKind::Config, "a model has no name");
  if (file.empty()) fail(ErrorKind::Config, "model {}: file is missing", name);
}

Model read_model(const ModelOptions& options, std::uint64_t& texture_bytes_left) {
  return core::with_context([&] { return read(options, texture_bytes_left); },
                            fmt::format("reading model {}", options.name));
}

std::vector<core::KnownTable> model_tables() {
  return {{"glTF", "members, attributes and extensions", gltf_names()},
          {"OBJ", "statements", obj_names()},
          {"MTL", "statements of libraries of materials", mtl_names()},
          {"PLY", "elements, properties and lines of the head", ply_names()}};
}

}  // namespace terracast::tiler

#pragma once

#include <assimp/DefaultIOSystem.h>

#include <assimp/IOStream.hpp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tiler/objects/obj_check.h"

namespace terracast::tiler {

/// A file's bytes.
/// name     for messages
/// throws   Io: no such file; Input: more than a model may have
std::vector<std::byte> bytes_of(const std::filesystem::path& file, const std::string& name);

/// Lets assimp read the model's folder alone, and not more than the bound. What an OBJ names is a library of materials.
/// Nothing is read any more when a stop is asked for.
class ModelFolder final : public Assimp::DefaultIOSystem {
 public:
  /// obj   null: the model is of another kind
  ModelFolder(std::filesystem::path model, const std::filesystem::path& folder, ObjCheck* obj)
      : model_(std::move(model)), folder_(std::filesystem::weakly_canonical(folder)), obj_(obj) {}

  bool Exists(const char* file) const override;
  Assimp::IOStream* Open(const char* file, const char* mode) override;

  /// What was wrong with what was asked for.
  /// model    for messages
  /// throws   Input: leads out of the folder, holds more than the bound, libraries as ObjCheck; Interrupted
  void check(const std::string& model) const;
  /// Libraries of materials that are not there; one of the model's own name counts where it alone is
  /// missing, as assimp asks for it by itself.
  std::int64_t num_missing() const;

 private:
  bool is_inside(const char* file) const;
  bool is_library_right(const char* file);

  std::filesystem::path model_;
  std::filesystem::path folder_;
  ObjCheck* obj_;
  mutable std::string escaped_;
  std::uint64_t opened_bytes_ = 0;
  std::set<std::filesystem::path> missing_;
  std::exception_ptr refused_;
};

}  // namespace terracast::tiler

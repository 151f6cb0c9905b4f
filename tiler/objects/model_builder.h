#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tiler/objects/model_file.h"
#include "tiler/objects/model_folder.h"
#include "tiler/objects/model_scene.h"

namespace terracast::tiler {

/// Makes a model of what its file says: brings its places to the lattice, multiplies colours and decodes pictures.
class ModelBuilder {
 public:
  ModelBuilder(const ModelOptions& options, ModelFolder& folder, std::uint64_t& texture_bytes_left);

  /// throws   as read_model()
  Model build(ModelScene scene);

 private:
  using Steps = Eigen::Matrix<std::int64_t, 3, 1>;

  void add(const ModelPart& part);
  std::vector<std::uint32_t> add_vertices(const ModelPart& part, bool is_textured);
  std::uint32_t look_of(const ModelPart& part, const std::array<std::uint32_t, 3>& corners,
                        const std::optional<std::uint16_t>& texture);
  std::optional<std::uint16_t> texture_of(const ModelMaterial& material);
  std::optional<std::uint16_t> read_texture(const ModelImage& image, bool shows_through);
  void merge_looks();
  void finish();
  void add_levels(world::Shape shape, double size_m);
  [[noreturn]] void fail_empty() const;

  const ModelOptions& options_;
  ModelFolder& folder_;
  std::uint64_t& texture_bytes_left_;
  std::string name_;
  core::SemanticClass semantic_class_ = core::SemanticClass::Object;
  Eigen::Matrix3d axes_;
  ModelScene scene_;
  Model model_;
  std::vector<Steps> places_;
  std::vector<Eigen::Vector2f> uv_;
  struct Triangle {
    std::array<std::uint32_t, 3> corners = {};
    std::uint32_t look = 0;
  };
  std::vector<Triangle> triangles_;
  std::vector<world::Finish> looks_;  ///< as many as there are
  std::map<std::tuple<world::Material, std::uint16_t, std::array<std::uint8_t, 3>>, std::uint32_t>
      look_rows_;
  std::map<std::pair<std::size_t, bool>, std::optional<std::uint16_t>> textures_;
  bool has_texture_ = false;
};

}  // namespace terracast::tiler

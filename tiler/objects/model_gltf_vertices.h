#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/json.h"
#include "core/ledger.h"
#include "tiler/objects/model_gltf_data.h"

namespace terracast::tiler {

/// What a primitive's vertices need beside its own attributes.
struct GltfVertexInputs {
  std::string texture_attribute;  ///< TEXCOORD_n; empty: none
  std::vector<double> weights;    ///< of the mesh's targets
  std::vector<Eigen::Matrix4d>
      joints;         ///< of its skin: scene from bound vertex; empty: it has none
  std::string where;  ///< for messages
};

/// The vertices of a primitive of glTF, one by one: targets are mixed in by their shares, and joints move them.
class GltfVertices {
 public:
  /// Counts the attributes.
  /// throws   Input: no POSITION, attributes of the wrong type or of other lengths
  GltfVertices(const GltfBuffers& buffers, const core::Json& primitive, GltfVertexInputs inputs,
               core::Ledger& ledger);

  std::size_t size() const { return position_->size(); }
  /// In the mesh's own axes; with joints, in the scene's.
  /// throws   Input: no number, a joint that there is none of
  Eigen::Vector3d place(std::size_t vertex);
  bool has_texture() const { return texture_.has_value(); }
  Eigen::Vector2d texture(std::size_t vertex) const;
  bool has_color() const { return color_.has_value(); }
  Eigen::Array3d color(std::size_t vertex) const;

  /// Vertices whose shares of joints are all 0.
  std::int64_t num_unbound() const { return num_unbound_; }

 private:
  struct Target {
    double weight = 0.0;
    std::optional<GltfAccessor> position, texture, color;
  };

  std::optional<GltfAccessor> attribute(const core::Json& attributes, const std::string& name,
                                        int least, int most) const;
  void add_targets(const core::Json& primitive, core::Ledger& ledger);
  void add_joints(const core::Json& attributes);
  void count(const core::Json& attributes, core::Ledger& ledger) const;
  Eigen::Vector3d moved(std::size_t vertex, const Eigen::Vector3d& bound);

  const GltfBuffers& buffers_;
  GltfVertexInputs inputs_;
  std::optional<GltfAccessor> position_, texture_, color_;
  std::vector<Target> targets_;  ///< of those that are mixed in
  std::vector<GltfAccessor> joints_, weights_;
  std::int64_t num_unbound_ = 0;
};

}  // namespace terracast::tiler

#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tiler/objects/model_gltf_data.h"
#include "tiler/objects/model_scene.h"

namespace terracast::tiler {

/// Where a material's picture lies on its surfaces.
struct GltfPicture {
  /// Set of the coordinates; empty: it has no picture.
  std::string attribute;
  /// Of the coordinates as they stand, y downward, to those of the world's textures, y upward.
  Eigen::Matrix3d uv = Eigen::Matrix3d::Identity();
};

/// Adds the materials of a glTF file to a scene, and one more for primitives that name none.
/// returns   of each of these, its picture
/// throws    Input: numbers of textures, images and samplers that there are none of
std::vector<GltfPicture> add_gltf_materials(const GltfBuffers& buffers, const ModelFolder& folder,
                                            ModelScene& scene);

}  // namespace terracast::tiler

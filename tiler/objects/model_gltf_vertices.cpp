#include "tiler/objects/model_gltf_vertices.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "core/error.h"
#include "tiler/objects/model_gltf_names.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Array3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// More sets of joints no vertex has.
constexpr int kMostSets = 16;

template <int Size>
Eigen::Matrix<double, Size, 1> values_of(const GltfAccessor& accessor, std::size_t vertex) {
  Eigen::Matrix<double, Size, 1> values;
  for (int k = 0; k < Size; ++k) values[k] = accessor.value(vertex, k);
  return values;
}

}  // namespace

GltfVertices::GltfVertices(const GltfBuffers& buffers, const Json& primitive,
                           GltfVertexInputs inputs, core::Ledger& ledger)
    : buffers_(buffers), inputs_(std::move(inputs)) {
  const Json& attributes = primitive.at("attributes");
  position_ = attribute(attributes, "POSITION", 3, 3);
  if (!position_) fail(ErrorKind::Input, "{}: it has no POSITION", inputs_.where);
  if (!inputs_.texture_attribute.empty())
    texture_ = attribute(attributes, inputs_.texture_attribute, 2, 2);
  color_ = attribute(attributes, "COLOR_0", 3, 4);
  count(attributes, ledger);
  add_targets(primitive, ledger);
  if (!inputs_.joints.empty()) add_joints(attributes);
}

std::optional<GltfAccessor> GltfVertices::attribute(const Json& attributes, const std::string& name,
                                                    int least, int most) const {
  if (!attributes.has(name)) return std::nullopt;
  GltfAccessor accessor(buffers_, attributes.at(name).integer(),
                        fmt::format("{}: {}", inputs_.where, name));
  if (accessor.num_components() < least || accessor.num_components() > most)
    fail(ErrorKind::Input, "{}: {} has {} components, and {} to {} are right", inputs_.where, name,
         accessor.num_components(), least, most);
  if (position_ && accessor.size() != position_->size())
    fail(ErrorKind::Input, "{}: {} is of {} vertices, and POSITION of {}", inputs_.where, name,
         accessor.size(), position_->size());
  return accessor;
}

void GltfVertices::count(const Json& attributes, core::Ledger& ledger) const {
  for (const auto& [name, row] : attributes.members()) {
    const std::string whole = "glTF attribute " + name;
    if (name.starts_with("TEXCOORD_") && name != inputs_.texture_attribute)
      ledger.ignore(whole, "no picture that is shown lies by this set");
    else if ((name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")) &&
             inputs_.joints.empty())
      ledger.ignore(whole, "its node has no skin");
    else
      ledger.count(whole, gltf_names());
  }
}

void GltfVertices::add_targets(const Json& primitive, core::Ledger& ledger) {
  const Json& targets = gltf_list(primitive, "targets");
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const Json& attributes = targets.at(i);
    const double weight = i < inputs_.weights.size() ? inputs_.weights[i] : 0.0;
    if (weight == 0.0) continue;
    count(attributes, ledger);
    targets_.push_back({.weight = weight,
                        .position = attribute(attributes, "POSITION", 3, 3),
                        .texture = texture_ ? attribute(attributes, inputs_.texture_attribute, 2, 2)
                                            : std::nullopt,
                        .color = color_ ? attribute(attributes, "COLOR_0", 3, 4) : std::nullopt});
  }
}

void GltfVertices::add_joints(const Json& attributes) {
  for (int set = 0; set < kMostSets; ++set) {
    const auto joints = attribute(attributes, fmt::format("JOINTS_{}", set), 4, 4);
    const auto weights = attribute(attributes, fmt::format("WEIGHTS_{}", set), 4, 4);
    if (!joints || !weights) break;
    if (!joints->is_whole())
      fail(ErrorKind::Input, "{}: JOINTS_{} are no whole numbers", inputs_.where, set);
    joints_.push_back(*joints);
    weights_.push_back(*weights);
  }
  if (joints_.empty())
    fail(ErrorKind::Input,
         "{}: its node has a skin, and it has no JOINTS_0 and WEIGHTS_0; export the model without "
         "the skin",
         inputs_.where);
}

Vector3d GltfVertices::place(std::size_t vertex) {
  Vector3d place = values_of<3>(*position_, vertex);
  for (const Target& target : targets_)
    if (target.position) place += target.weight * values_of<3>(*target.position, vertex);
  if (!joints_.empty()) place = moved(vertex, place);
  if (!place.allFinite())
    fail(ErrorKind::Input, "{}: vertex {} is no number", inputs_.where, vertex);
  return place;
}

Vector3d GltfVertices::moved(std::size_t vertex, const Vector3d& bound) {
  Matrix4d sum = Matrix4d::Zero();
  double shares = 0.0;
  for (std::size_t set = 0; set < joints_.size(); ++set)
    for (int k = 0; k < 4; ++k) {
      const double share = weights_[set].value(vertex, k);
      if (share == 0.0) continue;
      const std::uint32_t joint = joints_[set].whole(vertex, k);
      if (joint >= inputs_.joints.size())
        fail(ErrorKind::Input, "{}: vertex {} names joint {} of {}", inputs_.where, vertex, joint,
             inputs_.joints.size());
      sum += share * inputs_.joints[joint];
      shares += share;
    }
  if (shares == 0.0) {  // to the first joint, as viewers have it
    ++num_unbound_;
    sum = inputs_.joints.front();
    shares = 1.0;
  }
  // Shares that were rounded do not add up to 1.
  return (sum * bound.homogeneous()).head<3>() / shares;
}

Vector2d GltfVertices::texture(std::size_t vertex) const {
  Vector2d place = values_of<2>(*texture_, vertex);
  for (const Target& target : targets_)
    if (target.texture) place += target.weight * values_of<2>(*target.texture, vertex);
  return place;
}

Array3d GltfVertices::color(std::size_t vertex) const {
  Array3d color = values_of<3>(*color_, vertex).array();
  for (const Target& target : targets_)
    if (target.color) color += target.weight * values_of<3>(*target.color, vertex).array();
  return color;
}

}  // namespace terracast::tiler

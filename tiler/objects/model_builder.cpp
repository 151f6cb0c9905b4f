#include "tiler/objects/model_builder.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/printable.h"
#include "core/semantic_class.h"
#include "core/stop.h"
#include "tiler/objects/model_texture.h"
#include "tiler/objects/vertex_clusters.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Array3d;
using Eigen::Vector2f;
using Eigen::Vector3d;
using world::Material;
using world::Shape;

/// Raised when the same file gives another model.
constexpr int kModelVersion = 2;

/// No model is larger: its vertices would not fit beside a tile.
constexpr double kLargest_m = 2000.0;
constexpr std::size_t kMostFinishes = 256;
constexpr int kCoarsestModelLevel = 6;
/// So many are numbered by finishes.
constexpr std::size_t kMostTextures = 65535;
/// A picture seen farther from its own corner than so many of its lengths has no place that a float could tell.
constexpr float kFarthestUv = 1e6F;

double srgb_from_linear(double value) {
  return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}
/// Half a code in the file is half a code still, to linear light, of which floats keep 24 bits, and back.
std::uint8_t code_of(double linear) {
  const double srgb = srgb_from_linear(std::clamp(linear, 0.0, 1.0));
  return static_cast<std::uint8_t>(std::min(255L, std::lround(255.0 * srgb + 1e-4)));
}
std::array<std::uint8_t, 3> codes_of(const Array3d& linear) {
  return {code_of(linear[0]), code_of(linear[1]), code_of(linear[2])};
}

core::Image8 without_alpha(const core::Image8& image) {
  core::Image8 out(image.width(), image.height(), 3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      for (int k = 0; k < 3; ++k) out(x, y, k) = image(x, y, k);
  return out;
}

}  // namespace

double linear_from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}
Array3d linear_from_srgb(const Array3d& color) {
  return {linear_from_srgb(color[0]), linear_from_srgb(color[1]), linear_from_srgb(color[2])};
}

ModelBuilder::ModelBuilder(const ModelOptions& options, ModelFolder& folder,
                           std::uint64_t& texture_bytes_left)
    : options_(options),
      folder_(folder),
      texture_bytes_left_(texture_bytes_left),
      name_(folder.name()) {
  for (std::size_t i = 0; i < core::semantic_classes().size(); ++i)
    if (core::semantic_class_names()[i] == options.semantic_class)
      semantic_class_ = core::semantic_classes()[i].id;
  axes_.setIdentity();
  // y up, front along z: to x forward, y left, z up.
  if (options.up == "y") axes_ << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const double turn = options.yaw_deg * std::numbers::pi / 180.0;
  axes_ = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix() * axes_ * options.unit_m;
}

Model ModelBuilder::build(ModelScene scene) {
  scene_ = std::move(scene);
  for (const ModelPart& part : scene_.parts) {
    core::throw_if_stop_asked();
    add(part);
  }
  finish();
  return std::move(model_);
}

void ModelBuilder::fail_empty() const { fail(ErrorKind::Input, "{}: it holds no triangle", name_); }

void ModelBuilder::add(const ModelPart& part) {
  const ModelMaterial& material = scene_.materials.at(part.material);
  const std::optional<std::uint16_t> texture = texture_of(material);
  has_texture_ = has_texture_ || texture.has_value();
  const std::vector<std::uint32_t> numbers = add_vertices(part, texture.has_value());
  const auto is_within = [&](std::uint32_t corner) {
    const Vector2f& uv = uv_[numbers[corner]];
    return uv.minCoeff() >= 0.0F && uv.maxCoeff() <= 1.0F;
  };
  for (const auto& triangle : part.triangles) {
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) corners[k] = numbers[triangle[k]];
    const auto at = [&](std::size_t k) -> Vector3d { return places_[corners[k]].cast<double>(); };
    if ((at(1) - at(0)).cross(at(2) - at(0)).squaredNorm() == 0.0) {
      ++scene_.counts["triangles without area"];
      continue;
    }
    if (texture && !material.repeats && !std::all_of(triangle.begin(), triangle.end(), is_within))
      ++scene_.counts["triangles beyond a picture's edge, where it repeats all the same"];
    triangles_.push_back({.corners = corners, .look = look_of(part, triangle, texture)});
  }
}

/// Returns the numbers of a part's places; those that are alike are one.
std::vector<std::uint32_t> ModelBuilder::add_vertices(const ModelPart& part, bool is_textured) {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(part.places.size());
  std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t, float, float>, std::uint32_t> known;
  for (std::size_t i = 0; i < part.places.size(); ++i) {
    const Vector3d place = axes_ * part.places[i];
    if (!place.allFinite()) fail(ErrorKind::Input, "{}: a vertex is no number", part.name);
    if (place.cwiseAbs().maxCoeff() > 1e6)
      fail(ErrorKind::Input, "{}: a vertex lies at {:.3g} m; set unit_m", name_,
           place.cwiseAbs().maxCoeff());
    Vector2f uv = Vector2f::Zero();
    if (is_textured && !part.uv.empty()) uv = part.uv[i];
    if (!uv.allFinite() || uv.cwiseAbs().maxCoeff() > kFarthestUv) {
      ++scene_.counts["corners whose place on a picture is no number"];
      uv.setZero();
    }
    const Steps steps = (place / world::kHeightStep_m).array().round().cast<std::int64_t>();
    const auto [entry, is_new] =
        known.try_emplace({steps.x(), steps.y(), steps.z(), uv.x(), uv.y()},
                          static_cast<std::uint32_t>(places_.size()));
    if (is_new) {
      places_.push_back(steps);
      uv_.push_back(uv);
    }
    numbers.push_back(entry->second);
  }
  return numbers;
}

/// Factor x picture x colour of vertices, in linear light; of the last the mean of a triangle's three.
std::uint32_t ModelBuilder::look_of(const ModelPart& part,
                                    const std::array<std::uint32_t, 3>& corners,
                                    const std::optional<std::uint16_t>& texture) {
  const ModelMaterial& material = scene_.materials[part.material];
  Array3d color = texture ? material.factor : material.factor_without_image;
  if (!part.colors.empty() && (!texture || material.tints_image))
    color *= (part.colors[corners[0]] + part.colors[corners[1]] + part.colors[corners[2]])
                 .cast<double>() /
             3.0;
  const Material kind = texture             ? Material::Textured
                        : material.is_metal ? Material::Metal
                                            : Material::Plain;
  const world::Finish look{.material = kind,
                           .semantic_class = semantic_class_,
                           .color_srgb = codes_of(color),
                           .pattern = texture.value_or(0)};
  const auto [known, is_new] = look_rows_.try_emplace(
      {look.material, look.pattern, look.color_srgb}, static_cast<std::uint32_t>(looks_.size()));
  if (is_new) looks_.push_back(look);
  return known->second;
}

std::optional<std::uint16_t> ModelBuilder::texture_of(const ModelMaterial& material) {
  if (!material.image) return std::nullopt;
  const auto [known, is_new] = textures_.try_emplace({*material.image, material.shows_through});
  if (is_new)
    known->second = read_texture(scene_.images.at(*material.image), material.shows_through);
  return known->second;
}

std::optional<std::uint16_t> ModelBuilder::read_texture(const ModelImage& image,
                                                        bool shows_through) {
  const std::string short_name = core::printable(core::first_letters(image.name, 80));
  const std::string where = fmt::format("{}: texture {}", name_, short_name);
  std::error_code error;
  if (image.bytes.empty() && !std::filesystem::is_regular_file(image.file, error)) {
    ++scene_.counts["textures missing"];
    scene_.ledger.misunderstand("texture", short_name + " is not there");
    return std::nullopt;
  }
  const std::vector<std::byte> bytes =
      image.bytes.empty() ? folder_.read(image.file, where) : image.bytes;
  const auto byte = [&](std::size_t at) {
    return at < bytes.size() ? static_cast<unsigned>(bytes[at]) : 0U;
  };
  if (!(byte(0) == 0x89 && byte(1) == 'P') && !(byte(0) == 0xff && byte(1) == 0xd8)) {
    ++scene_.counts["textures of a kind that is not read"];
    scene_.ledger.misunderstand("texture", short_name + " is neither PNG nor JPEG");
    return std::nullopt;
  }
  if (model_.textures.size() >= kMostTextures)
    fail(ErrorKind::Input, "{}: a model has at most {} textures", where, kMostTextures);
  core::Image8 pixels = decode_texture(bytes, where, texture_bytes_left_);
  if (pixels.channels() == 4 && !shows_through) {
    texture_bytes_left_ += world::mip_bytes(pixels.width(), pixels.height(), 4) -
                           world::mip_bytes(pixels.width(), pixels.height(), 3);
    pixels = without_alpha(pixels);
  }
  std::string file_name = short_name;
  std::replace(file_name.begin(), file_name.end(), '\\', '/');
  model_.textures.push_back(
      {.name = fmt::format("{}/{}", options_.name,
                           std::filesystem::path(file_name).filename().string()),
       .image = std::move(pixels)});
  return static_cast<std::uint16_t>(model_.textures.size() - 1);
}

/// Where there are more looks than a shape may have, colours in one cell of a grid are one; the finest grid that will do.
void ModelBuilder::merge_looks() {
  using Key = std::tuple<Material, std::uint16_t, std::array<std::uint8_t, 3>>;
  for (int cell = 2; looks_.size() > kMostFinishes; cell *= 2) {
    if (cell > 256)
      fail(ErrorKind::Input,
           "{}: it has {} textures and kinds of surface, and a model at most {}; put its textures "
           "together in fewer",
           name_, looks_.size(), kMostFinishes);
    std::map<Key, std::uint32_t> rows;
    std::vector<world::Finish> merged;
    std::vector<std::uint32_t> row_of;
    for (world::Finish look : looks_) {
      // A picture's tint would dim all of it.
      const bool is_kept = look.material == Material::Textured && cell < 256;
      for (std::uint8_t& code : look.color_srgb)
        if (!is_kept) code = static_cast<std::uint8_t>(code / cell * cell + cell / 2);
      const auto [known, is_new] = rows.try_emplace({look.material, look.pattern, look.color_srgb},
                                                    static_cast<std::uint32_t>(merged.size()));
      if (is_new) merged.push_back(look);
      row_of.push_back(known->second);
    }
    scene_.counts["colours merged"] += static_cast<std::int64_t>(looks_.size() - merged.size());
    looks_ = std::move(merged);
    for (Triangle& triangle : triangles_) triangle.look = row_of[triangle.look];
  }
}

void ModelBuilder::finish() {
  if (triangles_.empty()) fail_empty();
  merge_looks();
  Steps low = places_[triangles_[0].corners[0]];
  Steps high = low;
  for (const Triangle& triangle : triangles_)
    for (const std::uint32_t corner : triangle.corners) {
      low = low.cwiseMin(places_[corner]);
      high = high.cwiseMax(places_[corner]);
    }
  Steps shift = Steps::Zero();
  if (options_.origin == "foot")
    shift << (low.x() + high.x()) / 2, (low.y() + high.y()) / 2, low.z();
  const Vector3d size_m = (high - low).cast<double>() * world::kHeightStep_m;
  const double reach_m = std::max((low - shift).cast<double>().cwiseAbs().maxCoeff(),
                                  (high - shift).cast<double>().cwiseAbs().maxCoeff()) *
                         world::kHeightStep_m;
  if (reach_m > kLargest_m)
    fail(ErrorKind::Input,
         "{}: it reaches {:.0f} m from its origin, and a model at most {:.0f} m; set unit_m", name_,
         reach_m, kLargest_m);
  Shape shape;
  for (const auto& place : places_) shape.vertices_steps.push_back((place - shift).cast<int>());
  if (has_texture_) shape.uv = uv_;
  for (const Triangle& triangle : triangles_)
    shape.triangles.push_back(
        {.corners = triangle.corners, .finish = static_cast<std::uint8_t>(triangle.look)});
  shape.finishes = looks_;
  add_levels(std::move(shape), size_m.maxCoeff());
  // What it covers, wherever its origin is.
  const Vector3d far =
      (low - shift).cast<double>().cwiseAbs().cwiseMax((high - shift).cast<double>().cwiseAbs()) *
      world::kHeightStep_m;
  model_.footprint_m = 2.0 * far.head<2>();
  model_.prototype.name = options_.name;
  model_.prototype.is_model = true;
  model_.content_hash = core::content_hash(fmt::format(
      "{} {} {} {} {} {} {} {}", kModelVersion, folder_.hashes(), options_.name,
      options_.semantic_class, options_.up, options_.origin, options_.unit_m, options_.yaw_deg));
  model_.counts.emplace_back("triangles", static_cast<std::int64_t>(triangles_.size()));
  for (const auto& [what, number] : scene_.counts)
    if (number > 0) model_.counts.emplace_back(what, number);
  model_.ledger = std::move(scene_.ledger);
}

/// A tile of level L shows a metre as 2^(1 - L) pixels and more: cells are half a pixel.
void ModelBuilder::add_levels(Shape shape, double size_m) {
  const int last = std::clamp(static_cast<int>(std::ceil(std::log2(std::max(size_m, 0.25)))), 0,
                              kCoarsestModelLevel);
  model_.prototype.levels.push_back({.coarsest_level = 0, .shape = std::move(shape)});
  for (int level = 1; level <= last; ++level) {
    const Shape& finest = model_.prototype.levels.front().shape;
    Shape coarse = clustered(finest, 0.25 * std::exp2(level));
    world::ShapeLevel& before = model_.prototype.levels.back();
    // Not worth a level of its own, or nothing left: what is there goes on.
    if (coarse.triangles.size() < 4 ||
        10 * coarse.triangles.size() > 7 * before.shape.triangles.size())
      before.coarsest_level = static_cast<std::int8_t>(level);
    else
      model_.prototype.levels.push_back(
          {.coarsest_level = static_cast<std::int8_t>(level), .shape = std::move(coarse)});
  }
}

}  // namespace terracast::tiler

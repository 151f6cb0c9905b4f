#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/printable.h"
#include "core/semantic_class.h"
#include "validate/checks/checker.h"
#include "validate/null_distribution.h"
#include "validate/oracle/shown_geometry.h"
#include "validate/oracle_claims.h"
#include "validate/oracle_pixels.h"

/// The dataset against its world: exact rays through sampled pixels, from the format's own poses and
/// intrinsics, meet the exact triangles of the tiles that the dataset says it shows. What they find is
/// compared with depth, disparity, classes and claims of visibility.
namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using oracle::ExactHit;
using oracle::ExactRay;
using oracle::ExactWorld;
using oracle::Ground;

/// A corner of a triangle covers a place when it counts for more than the others by so much.
constexpr double kWeightTie = 1e-6;
constexpr double kDisparityStep_px = 1.0 / 256.0;
constexpr double kNormalBound = 5e-4;  // of length 1
constexpr double kMostSilhouettes = 1e-3;
/// Fifteen silhouettes through each pixel, met by a shift of 0.001 px in four directions.
constexpr double kMostSilhouettesOfObjects = 0.06;

const char* name_of(Ground ground) {
  switch (ground) {
    case Ground::Sea:
      return "sea";
    case Ground::Outside:
      return "outside";
    case Ground::Lake:
      return "lake";
    case Ground::River:
      return "river";
    case Ground::Seabed:
      return "seabed";
    case Ground::Land:
      break;
  }
  return "land";
}

std::string_view class_name(std::uint8_t semantic_class) {
  return core::semantic_class_names()[semantic_class];
}

/// What covers a hit: the ground of the corner that counts most; nothing where two count alike.
std::optional<Ground> ground_of(const ExactHit& hit) {
  if (hit.grounds[0] == hit.grounds[1] && hit.grounds[0] == hit.grounds[2]) return hit.grounds[0];
  const std::array<double, 3> weights = hit.weights_at(hit.point_world.x(), hit.point_world.y());
  for (std::size_t k = 0; k < 3; ++k) {
    bool is_most = true;
    for (std::size_t other = 0; other < 3; ++other)
      if (hit.grounds[other] != hit.grounds[k] && weights[other] > weights[k] - kWeightTie)
        is_most = false;
    if (is_most) return hit.grounds[k];
  }
  return std::nullopt;
}

/// What the cover of the ground lets a class be called. Land's classes follow from the material too.
bool is_class_of(const std::string& name, Ground ground) {
  if (ground != Ground::Land) return name == name_of(ground);
  static constexpr std::array kOfLand = {"rock",     "scree",   "grass",        "soil",
                                         "sand",     "snow",    "forest_floor", "shrubland",
                                         "cropland", "wetland", "built_up"};
  return std::find(kOfLand.begin(), kOfLand.end(), name) != kOfLand.end();
}

class OracleChecker : public Checker {
 public:
  explicit OracleChecker(const ValidateOptions& options) : options_(options), claims_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    if (options_.world.empty()) return;
    if (!is_begun_) begin(window.dataset(), window.sequence());
    if (!terrain_) return;
    const auto num_cameras = static_cast<int>(window.sequence().cameras.size());
    std::vector<std::optional<Sampled>> sampled(static_cast<std::size_t>(num_cameras));
    for (int camera = 0; camera < num_cameras; ++camera) {
      const std::optional<View> view = window.view(camera, window.frame());
      if (!view) continue;
      const OracleView placed = place(window.dataset(), *view);
      if (!placed.is_usable()) continue;  // `trajectory` and `calibration` tell of it
      claims_.look_at_tracks(window.sequence(), placed);
      if (view->image->depth.empty()) continue;
      Sampled& sample = sampled[static_cast<std::size_t>(camera)].emplace(Sampled{
          placed, choose_pixels(*terrain_, placed, options_.oracle_samples, options_.seed)});
      compare(window, sample);
    }
    claims_.look_at_flow(window, last_, sampled);
    last_ = std::move(sampled);
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence&) override {
    if (options_.world.empty())
      return {skipped_result("oracle", "no world to hold it against: give --world STORE")};
    if (!is_begun_) return {unseen_result("oracle", "no frame could be read")};
    std::vector<CheckResult> results = {geometry_result()};
    if (terrain_) {
      results.push_back(depth_result());
      results.push_back(class_result());
      results.push_back(claims_.result());
      results.push_back(edges_result());
    } else {
      for (const char* name : {"oracle_depth", "oracle_class", "oracle_occlusion", "oracle_edges"})
        results.push_back(skipped_result(name, "no ground to hold it against: oracle_geometry"));
    }
    results.push_back(normal_result());
    results.push_back(instance_result());
    return results;
  }

 private:
  // ---- the ground

  void begin(const Dataset& dataset, const Sequence& sequence) {
    is_begun_ = true;
    world_.emplace(options_.world);
    if (world_->input_hash() != dataset.world_input_hash || world_->name() != dataset.world_name)
      fail(ErrorKind::Input,
           "{}: the world {} of inputs {}; the dataset shows {} of inputs {}: give the world that "
           "it was rendered from",
           options_.world.string(), world_->name(), world_->input_hash(), dataset.world_name,
           dataset.world_input_hash);
    if (sequence.geometry.empty())
      fail(ErrorKind::Input,
           "{}: dataset.json does not say which tiles sequence {} shows, as those of older "
           "versions: render and export it again to hold it against a world",
           dataset.root.string(), sequence.name);
    world_from_local_ = world_from_local(*world_, sequence);
    compare_class_names(sequence);
    try {
      geometry_ = oracle::read_shown_geometry(dataset.root / sequence.geometry, sequence.geometry);
    } catch (const core::Error& error) {
      faults_ = {.count = 1, .first = error.message(), .can_be_measured = false};
      return;
    }
    faults_ = oracle::find_rule_faults(geometry_, *world_, eyes(sequence));
    if (!faults_.can_be_measured) return;
    std::vector<oracle::TileKey> tiles;
    for (const oracle::ShownTile& tile : geometry_.tiles) tiles.push_back(tile.key);
    // A sequence's cameras stand above the water or all in it (docs/render.md): the first one tells.
    const std::vector<oracle::Eye> all_eyes = eyes(sequence);
    if (!all_eyes.empty() &&
        ExactWorld::is_in_water(*world_, tiles, all_eyes.front().position_world))
      viewers_ = oracle::Viewers::InWater;
    terrain_ = std::make_unique<ExactWorld>(*world_, tiles, world_from_enu_of(*world_), viewers_);
    claims_.begin(*terrain_, world_from_local_);
  }

  /// Classes of terracast's worlds have one name and number each, also those that no image shows.
  void compare_class_names(const Sequence& sequence) {
    const auto known = core::semantic_class_names();
    for (const auto& [number, name] : sequence.classes)
      if (number < 0 || number >= std::ssize(known) ||
          known[static_cast<std::size_t>(number)] != name)
        class_.wrong(fmt::format("class {} is called {}", number, core::first_letters(name, 60)));
  }

  /// Where a camera's rays start, in its frame: at its place, or as far apart as the image's corners. Of rays that
  /// start between those less is asked than the rule asks, and of parallel rays nothing.
  static std::vector<Eigen::Vector3d> starts_of(const Intrinsics& camera) {
    if (!camera.plane || camera.plane->is_central()) return {Eigen::Vector3d::Zero()};
    std::vector<Eigen::Vector3d> starts;
    for (const double u : {0.0, 1.0 * camera.width_px})
      for (const double v : {0.0, 1.0 * camera.height_px})
        starts.push_back(camera.origin_from_pixel({u, v}));
    return starts;
  }

  std::vector<oracle::Eye> eyes(const Sequence& sequence) const {
    std::vector<oracle::Eye> all;
    for (const Camera& camera : sequence.cameras) {
      if (!camera.intrinsics.is_sound()) continue;
      const double finest = finest_pixels_per_radian(camera.intrinsics);
      const std::vector<Eigen::Vector3d> starts = starts_of(camera.intrinsics);
      for (std::size_t i = 0; i < camera.local_from_camera.size(); ++i)
        for (const Eigen::Vector3d& start : starts)
          if (camera.local_from_camera[i])
            all.push_back({world_from_local_ * (*camera.local_from_camera[i] * start), finest,
                           fmt::format("{}, frame {},", camera.name, i)});
    }
    return all;
  }

  OracleView place(const Dataset& dataset, const View& view) const {
    double distance_m = 0.0;
    if (const auto& first = view.camera->local_from_camera.front())
      distance_m = (view.local_from_camera.translation - first->translation).norm();
    return {view, world_from_local_ * view.local_from_camera,
            pose_rounding(dataset.format, distance_m)};
  }

  // ---- pixels

  void compare(const FrameWindow& window, const Sampled& sample) {
    const View& view = sample.view.view;
    const LoadedImage& image = *view.image;
    kinds_.add(sample.chosen.kinds);
    has_classes_ = has_classes_ || has_classes(window.sequence(), image);
    const Parallax stereo = parallax_of(window.sequence(), view);
    for (const OraclePixel& pixel : sample.chosen.pixels) {
      // The world knows what stands: `moving` tells of the rest.
      if (image.body_at(pixel.x, pixel.y) != 0 || !sample.view.has_ray(pixel.center())) continue;
      if (pixel.is_on_silhouette) {
        ++(pixel.reason == PixelReason::Random ? num_random_silhouettes_ : num_other_silhouettes_);
        if (pixel.reason == PixelReason::Random && first_silhouette_.empty())
          first_silhouette_ = place_of(view, pixel.x, pixel.y);
        continue;
      }
      compare_class(window.sequence(), view, pixel);
      compare_surface(sample.view, pixel);
      if (!pixel.hit) {
        if (!image.disparity.empty() && std::isfinite(image.disparity(pixel.x, pixel.y)))
          class_.wrong(place_of(view, pixel.x, pixel.y) + ": a disparity, where sky is");
        continue;
      }
      const double exact_m = OracleView::depth_m(*pixel.hit);
      const double allowed_m = sample.view.depth_error_m(pixel.center(), *pixel.hit);
      const auto stored_m = static_cast<double>(image.depth(pixel.x, pixel.y));
      if (std::isfinite(stored_m)) {
        ++num_depths_;
        note(std::abs(stored_m - exact_m) / allowed_m, [&] {
          return fmt::format("{}: depth {:.9g} m, exact {:.9g} m, {:.2g} m allowed",
                             place_of(view, pixel.x, pixel.y), stored_m, exact_m, allowed_m);
        });
      }
      if (image.disparity.empty()) continue;
      const auto stored_px = static_cast<double>(image.disparity(pixel.x, pixel.y));
      if (!std::isfinite(stored_px)) continue;
      ++num_disparities_;
      const double parallax_px = stereo.focal_baseline / exact_m;
      const double exact_px = parallax_px + stereo.offset_px;
      const double allowed_px = 0.5 * kDisparityStep_px + parallax_px * allowed_m / exact_m;
      note(std::abs(stored_px - exact_px) / allowed_px, [&] {
        return fmt::format("{}: disparity {:.6f} px, exact {:.6f} px, {:.2g} px allowed",
                           place_of(view, pixel.x, pixel.y), stored_px, exact_px, allowed_px);
      });
    }
  }

  /// share   NaN, of an allowance that nobody can tell, is a failure
  template <class Describe>
  void note(double share, const Describe& describe) {
    constexpr double kWrong = 1e9;
    if (!std::isfinite(share)) share = kWrong;
    if (!(share > worst_share_) && !worst_depth_.empty()) return;
    worst_share_ = share;
    worst_depth_ = describe();
  }

  /// Disparity is focal length times baseline by depth, and what principal points differ by.
  struct Parallax {
    double focal_baseline = 0.0;
    double offset_px = 0.0;
  };
  static Parallax parallax_of(const Sequence& sequence, const View& view) {
    if (!sequence.stereo || sequence.stereo->left != view.camera_index) return {};
    const Intrinsics& left = view.camera->intrinsics;
    const auto right = static_cast<std::size_t>(sequence.stereo->right);
    return {left.fx_px * sequence.stereo->baseline_m,
            left.cx_px - sequence.cameras[right].intrinsics.cx_px};
  }

  static bool has_classes(const Sequence& sequence, const LoadedImage& image) {
    return !image.segmentation.empty() && !sequence.classes.empty();
  }

  void compare_class(const Sequence& sequence, const View& view, const OraclePixel& pixel) {
    ++class_.num_judged;
    const LoadedImage& image = *view.image;
    const bool says_ground = std::isfinite(image.depth(pixel.x, pixel.y));
    if (says_ground != pixel.hit.has_value()) {
      class_.wrong(fmt::format("{}: the depth is {}, where {} is", place_of(view, pixel.x, pixel.y),
                               says_ground ? "a surface's" : "the sky's",
                               pixel.hit ? "ground" : "sky"));
      return;
    }
    if (!has_classes(sequence, image)) return;
    const auto found = sequence.classes.find(image.segmentation(pixel.x, pixel.y));
    if (found == sequence.classes.end()) return;  // `structure` tells of it
    const std::string& name = found->second;
    if (!pixel.hit) {
      if (name != "sky")
        class_.wrong(fmt::format("{}: {}, where sky is", place_of(view, pixel.x, pixel.y), name));
      return;
    }
    if (const auto& object = pixel.hit->object) {
      if (name != class_name(object->semantic_class))
        class_.wrong(fmt::format("{}: {}, where {} {} is", place_of(view, pixel.x, pixel.y), name,
                                 class_name(object->semantic_class), object->instance_id));
      return;
    }
    const oracle::Paint& paint = pixel.hit->paint;
    if (paint.is_tie) {
      ++class_.num_ties;
      return;
    }
    if (paint.is_painted) {
      if (name != class_name(paint.semantic_class) && !(paint.is_marked && name == "road_marking"))
        class_.wrong(fmt::format("{}: {}, where {} is painted", place_of(view, pixel.x, pixel.y),
                                 name, class_name(paint.semantic_class)));
      return;
    }
    const std::optional<Ground> ground = ground_of(*pixel.hit);
    if (!ground) {
      ++class_.num_ties;
    } else if (!is_class_of(name, *ground)) {
      class_.wrong(fmt::format("{}: {}, where {} is", place_of(view, pixel.x, pixel.y), name,
                               name_of(*ground)));
    }
  }

  // ---- surfaces

  void compare_surface(const OracleView& by, const OraclePixel& pixel) {
    const LoadedImage& image = *by.view.image;
    const std::string where = place_of(by.view, pixel.x, pixel.y);
    if (!image.instances.empty()) {
      has_instances_ = true;
      ++instance_.num_judged;
      const std::uint32_t exact = pixel.hit && pixel.hit->object
                                      ? static_cast<std::uint32_t>(pixel.hit->object->instance_id)
                                      : 0U;
      const std::uint32_t stored = image.instances(pixel.x, pixel.y);
      if (stored != exact)
        instance_.wrong(fmt::format("{}: instance {}, where {} is", where, stored, exact));
    }
    if (image.normals.empty()) return;
    has_normals_ = true;
    const Eigen::Vector3d stored(image.normals(pixel.x, pixel.y, 0),
                                 image.normals(pixel.x, pixel.y, 1),
                                 image.normals(pixel.x, pixel.y, 2));
    ++num_normals_;
    const auto error_of = [&](const std::optional<oracle::ExactHit>& hit) {
      if (stored.allFinite() != hit.has_value()) return 1e9;
      if (!hit) return 0.0;
      return (stored - world_from_local_.rotation.transpose() * hit->normal_world.normalized())
          .norm();
    };
    double error = error_of(pixel.hit);
    if (error > kNormalBound && is_any_beside(by, pixel, [&](const auto& beside) {
          return error_of(beside) <= kNormalBound;
        })) {
      ++num_tied_normals_;
      return;
    }
    if (error < worst_normal_ || (error == worst_normal_ && !worst_normal_place_.empty())) return;
    worst_normal_ = error;
    worst_normal_place_ = where;
  }

  /// Whether something holds of what one of four rays meets, a thousandth of a pixel beside: where rounding of the ray
  /// decides which of two triangles it meets.
  template <class Holds>
  bool is_any_beside(const OracleView& by, const OraclePixel& pixel, const Holds& holds) const {
    constexpr double kBeside_px = 1e-3;
    for (const int axis : {0, 1})
      for (const double side : {-kBeside_px, kBeside_px}) {
        const Eigen::Vector2d place = pixel.center() + side * Eigen::Vector2d::Unit(axis);
        if (by.has_ray(place) && holds(terrain_->first_hit(by.ray(place)))) return true;
      }
    return false;
  }

  CheckResult normal_result() const {
    if (!has_normals_) return skipped_result("oracle_normal", "the format holds no normals");
    CheckResult result;
    result.name = "oracle_normal";
    result.value = worst_normal_;
    result.bound = kNormalBound;
    result.unit = "(of length 1)";
    result.ok = result.is_within_bound();
    result.worst = worst_normal_place_;
    // A border is a line; of few pixels more may be on one by chance.
    const std::int64_t most_tied =
        binomial_quantile(kFalseVerdict, num_normals_, kMostSilhouettesOfObjects);
    if (result.ok && num_tied_normals_ > most_tied) {
      result.ok = false;
      result.value = static_cast<double>(num_tied_normals_);
      result.bound = static_cast<double>(most_tied);
      result.unit = "pixels, which show the other side of a triangle's border";
    }
    result.summary = fmt::format(
        "Largest difference between a normal and that of the triangle that an exact ray meets, of "
        "{} pixels; of {} more the ray passes a triangle's border within 1e-3 px, and the normal "
        "is "
        "that of the other side.",
        num_normals_ - num_tied_normals_, num_tied_normals_);
    result.reason =
        "Captures keep normals as half floats: 2.4e-4 in each of three numbers, 4.2e-4 together.";
    result.detects = "another frame, a sign, another triangle";
    return result;
  }

  CheckResult instance_result() const {
    if (!has_instances_) return skipped_result("oracle_instance", "the format holds no instances");
    CheckResult result;
    result.name = "oracle_instance";
    result.value = static_cast<double>(instance_.num_wrong);
    result.bound = 0.0;
    result.unit = "pixels";
    result.ok = result.is_within_bound();
    result.worst = instance_.first;
    result.summary =
        fmt::format("Instances against what exact rays meet, of {} pixels.", instance_.num_judged);
    result.reason = "Numbers are right or wrong.";
    result.detects = "one instance in another's place";
    return result;
  }

  // ---- results

  CheckResult geometry_result() const {
    CheckResult result;
    result.name = "oracle_geometry";
    result.value = static_cast<double>(faults_.count);
    result.unit = "faults";
    result.ok = faults_.count == 0;
    result.worst = faults_.first;
    result.summary = fmt::format(
        "{} tiles that the dataset says it shows, against the world {} and the written rules: "
        "each is the world's by its hash, they cover it without gap or overlap, neighbours differ "
        "by one level at most, and each is as fine as these cameras ask for ({} px a cell, not "
        "below {} m).",
        geometry_.tiles.size(), world_->name(), geometry_.cell_px, geometry_.finest_spacing_m);
    result.reason = "Levels are chosen by a rule without tolerance, tiles have hashes.";
    result.detects = "a tile left out, named twice, of another level or of other content";
    return result;
  }

  CheckResult depth_result() const {
    CheckResult result;
    result.name = "oracle_depth";
    result.value = worst_share_;
    result.bound = 1.0;
    result.unit = "of the rounding";
    if (num_depths_ == 0) return unseen_result(result.name, "no pixel with depth was sampled");
    result.ok = result.is_within_bound();
    result.worst = worst_depth_;
    result.summary = fmt::format(
        "Largest difference of {} depths and {} disparities from the exact ones, by what rounding "
        "leaves at that pixel. Of the pixels {} were drawn at random; of all, {} rays graze "
        "(under 3 degrees), {} pass within 0.01 px of an edge or corner of their triangle, {} "
        "meet a cell at a tile's border, {} of those where levels change, {} lie beside a "
        "silhouette, {} meet an object. {} exact rays.",
        num_depths_, num_disparities_, kinds_.num_random, kinds_.num_grazing, kinds_.num_near_edge,
        kinds_.num_border, kinds_.num_level_change, kinds_.num_beside_silhouette, kinds_.num_object,
        terrain_->stats().num_rays);
    result.reason =
        "float32 twice (range, then depth), half a step of 1/256 px of disparity, and the "
        "decimals of the format's poses, carried to the plane of the triangle that is hit.";
    result.detects =
        "twice the rounding in one pixel; a tile of another level, a border without stitches, the "
        "other diagonal of a cell";
    return result;
  }

  CheckResult class_result() const {
    CheckResult result;
    result.name = "oracle_class";
    result.value = static_cast<double>(class_.num_wrong);
    result.unit = "pixels";
    if (class_.num_judged == 0)
      return unseen_result(result.name, "no pixel with depth was sampled");
    result.ok = class_.num_wrong == 0;
    result.worst = class_.first;
    result.summary = fmt::format(
        "Of {} pixels, {} of them sky, those that depth{} say to be sky, sea, outside, land, paint "
        "or "
        "an object where the ray finds another. {} lie where two of them meet.",
        class_.num_judged, kinds_.num_sky, has_classes_ ? " and segmentation" : "",
        class_.num_ties);
    result.reason =
        "Sky is where an exact ray meets nothing; the ground's cover is that of the nearest "
        "corner of its triangle; paint lies where the distance from its line, or its rings, say; "
        "an "
        "object has the class of its triangle.";
    result.detects = "one class swapped";
    return result;
  }

  CheckResult edges_result() const {
    if (kinds_.num_random == 0)
      return unseen_result("oracle_edges", "no pixel with depth was sampled");
    CheckResult result;
    result.name = "oracle_edges";
    const auto count = static_cast<double>(kinds_.num_random);
    result.value = static_cast<double>(num_random_silhouettes_) / count;
    const double most = kinds_.num_object > 0 ? kMostSilhouettesOfObjects : kMostSilhouettes;
    result.bound = most + 4.0 * std::sqrt(most / count);
    result.unit = "share";
    result.ok = result.is_within_bound();
    result.worst = first_silhouette_;
    result.summary = fmt::format(
        "Share of {} random pixels where a ray shifted by 0.001 px meets another surface: they "
        "are left out of the comparison, with {} of those taken beside silhouettes and the like.",
        kinds_.num_random, num_other_silhouettes_);
    result.reason =
        "Silhouettes of ground lie pixels apart: 0.1 %; where there are objects, leaves that cross "
        "a "
        "pixel fifteen times: 6 %. And four standard errors of as many pixels.";
    result.detects = "silhouettes so dense that the comparison leaves out what it should compare";
    return result;
  }

  ValidateOptions options_;
  OracleClaims claims_;
  bool is_begun_ = false;
  std::optional<oracle::WorldFolder> world_;
  oracle::ShownGeometry geometry_;
  oracle::RuleFaults faults_;
  oracle::Viewers viewers_ = oracle::Viewers::AboveWater;
  std::unique_ptr<ExactWorld> terrain_;
  Pose world_from_local_;
  std::vector<std::optional<Sampled>> last_;  ///< of the last frame

  PixelKinds kinds_;
  std::int64_t num_depths_ = 0, num_disparities_ = 0;
  double worst_share_ = 0.0;
  std::string worst_depth_;
  Verdicts class_;
  Verdicts instance_;
  bool has_instances_ = false, has_normals_ = false;
  std::int64_t num_normals_ = 0, num_tied_normals_ = 0;
  double worst_normal_ = 0.0;
  std::string worst_normal_place_;
  bool has_classes_ = false;
  std::int64_t num_random_silhouettes_ = 0, num_other_silhouettes_ = 0;
  std::string first_silhouette_;
};

}  // namespace

std::unique_ptr<Checker> make_oracle_check(const ValidateOptions& options) {
  return std::make_unique<OracleChecker>(options);
}

}  // namespace terracast::validate

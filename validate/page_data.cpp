#include "validate/page_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "validate/page_bundle.h"
#include "validate/page_ground.h"
#include "validate/page_images.h"
#include "validate/page_values.h"

namespace terracast::validate {

namespace {

namespace fs = std::filesystem;
using core::Json;

constexpr int kPngLevel = 7;
/// Poses that a page draws, of all cameras and sequences together.
constexpr std::int64_t kMostPoses = 6000;
constexpr std::size_t kMostCloudPoints = 80'000;
constexpr int kMapPx = 900;

/// A value in steps of 1 / per_unit, which are short to write.
double decimals(double value, double per_unit) {
  const double steps = std::round(value * per_unit);
  return std::isfinite(steps) ? steps / per_unit + 0.0 : 0.0;
}

/// The twelve numbers of a pose, row by row; places to a tenth of a millimetre where only drawn.
Json pose_json(const Pose& pose, bool is_exact) {
  Json numbers = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double value = pose.rotation(row, column);
      numbers.push(is_exact ? value : decimals(value, 1e6));
    }
    numbers.push(is_exact ? pose.translation[row] : decimals(pose.translation[row], 1e4));
  }
  return numbers;
}

bool is_sound(const Pose& pose) {
  return pose.rotation.allFinite() && pose.translation.allFinite() &&
         pose.translation.norm() < 1e8 && pose.rotation.cwiseAbs().maxCoeff() < 2.0;
}

/// Writes a page's files and counts their bytes.
class PageFolder {
 public:
  explicit PageFolder(fs::path folder) : folder_(std::move(folder)) {}

  void write(const std::string& name, std::string_view text) {
    core::write_file(folder_ / name, text);
    note(name, text.size());
  }
  void write_png(const std::string& name, const core::Image8& image) {
    const std::vector<std::byte> bytes = core::encode_png(image, kPngLevel);
    core::write_file(folder_ / name, bytes);
    note(name, bytes.size());
  }
  std::uint64_t num_bytes() const { return num_bytes_; }

  /// Removes what an earlier report wrote and this one did not.
  void remove_others() const {
    for (const char* sub : {"images", "ground", "figures"})
      for (const std::string& name : list_folder(folder_ / sub)) {
        const fs::path path = fs::path(name);
        const std::string stem = path.stem().string();
        const bool is_ours = !stem.empty() &&
                             stem.find_first_not_of("0123456789") == std::string::npos &&
                             (path.extension() == ".png" || path.extension() == ".js");
        if (!is_ours || written_.contains(std::string(sub) + "/" + name)) continue;
        std::error_code ignored;
        fs::remove(folder_ / sub / name, ignored);
      }
  }

 private:
  void note(const std::string& name, std::size_t size) {
    const std::lock_guard lock(mutex_);
    num_bytes_ += size;
    written_.insert(name);
  }
  fs::path folder_;
  std::mutex mutex_;
  std::uint64_t num_bytes_ = 0;
  std::set<std::string> written_;
};

Json plot_json(const CheckResult::Plot& plot) {
  const auto numbers = [](const std::vector<double>& values) {
    Json list = Json::array();
    for (const double value : values) list.push(std::isfinite(value) ? Json(value) : Json());
    return list;
  };
  constexpr std::size_t kMostPoints = 3000;
  const CheckResult::Plot shown = thinned(plot, kMostPoints);
  return Json::object()
      .set("title", plot.title)
      .set("x_label", plot.x_label)
      .set("y_label", plot.y_label)
      .set("x", numbers(shown.x))
      .set("y", numbers(shown.y));
}

/// The plots and pictures of each check, by its name.
Json figures_json(const std::vector<CheckResult>& results, PageFolder& page) {
  Json figures = Json::object();
  std::size_t number = 0;
  for (const CheckResult& result : results) {
    Json plots = Json::array();
    Json pictures = Json::array();
    for (const CheckResult::Plot& plot : result.plots)
      if (std::min(plot.x.size(), plot.y.size()) > 1) plots.push(plot_json(plot));
    for (const CheckResult::Picture& picture : result.pictures) {
      const std::string file = fmt::format("figures/{:04}.png", number++);
      page.write_png(file, picture.image);
      pictures.push(Json::object()
                        .set("title", picture.title)
                        .set("file", file)
                        .set("width", picture.image.width())
                        .set("height", picture.image.height()));
    }
    if (plots.size() + pictures.size() > 0)
      figures.set(result.name, Json::object().set("plots", plots).set("pictures", pictures));
  }
  return figures;
}

Json camera_json(const Camera& camera, std::int64_t stride) {
  const Intrinsics& k = camera.intrinsics;
  Json frames = Json::array();
  Json poses = Json::array();
  for (std::size_t frame = 0; frame < camera.local_from_camera.size(); ++frame) {
    const auto& pose = camera.local_from_camera[frame];
    if (static_cast<std::int64_t>(frame) % stride != 0 || !pose || !is_sound(*pose)) continue;
    frames.push(static_cast<std::int64_t>(frame));
    poses.push(pose_json(*pose, false));
  }
  Json json = Json::object().set("name", camera.name).set("width_px", k.width_px);
  json.set("height_px", k.height_px);
  // The page draws pyramids and computes normals of cameras with depth alone.
  if (k.is_sound() && !k.plane)
    json.set("fx_px", k.fx_px).set("fy_px", k.fy_px).set("cx_px", k.cx_px).set("cy_px", k.cy_px);
  return json.set("track_frames", frames).set("track_poses", poses);
}

Json image_json(const PageImage& image, std::size_t index) {
  Json footprint = Json::array();
  for (const Eigen::Vector3d& point : image.footprint)
    footprint.push(Json::array_of(
        {decimals(point.x(), 10.0), decimals(point.y(), 10.0), decimals(point.z(), 10.0)}));
  Json json = Json::object()
                  .set("file", fmt::format("images/{:04}", index))
                  .set("sequence", image.place.sequence)
                  .set("camera", image.place.camera)
                  .set("frame", image.place.frame)
                  .set("width", image.width)
                  .set("height", image.height)
                  .set("step", image.step)
                  .set("has_color", !image.color.empty())
                  .set("layers", Json::array_of(image.layers))
                  .set("residual_frame", image.residual_frame)
                  .set("median_depth_m", decimals(image.median_depth_m, 1e3))
                  .set("footprint", footprint);
  if (image.local_from_camera) json.set("pose", pose_json(*image.local_from_camera, true));
  return json;
}

/// Every so many frames a pose is drawn.
std::int64_t pose_stride(const Dataset& dataset) {
  std::int64_t num_poses = 0;
  for (const Sequence& sequence : dataset.sequences)
    num_poses += sequence.num_frames * static_cast<std::int64_t>(sequence.cameras.size());
  return std::max<std::int64_t>(1, (num_poses + kMostPoses - 1) / kMostPoses);
}

Json sequence_json(const Sequence& sequence, std::int64_t stride) {
  Json classes = Json::object();
  for (const auto& [number, name] : sequence.classes) classes.set(std::to_string(number), name);
  Json cameras = Json::array();
  for (const Camera& camera : sequence.cameras) cameras.push(camera_json(camera, stride));
  Json json = Json::object()
                  .set("name", sequence.name)
                  .set("num_frames", sequence.num_frames)
                  .set("rate_hz", sequence.rate_hz)
                  .set("utc_start", sequence.utc_start)
                  .set("origin", Json::object()
                                     .set("lat_deg", sequence.origin.lat_deg)
                                     .set("lon_deg", sequence.origin.lon_deg)
                                     .set("height_m", sequence.origin.height_m))
                  .set("classes", classes)
                  .set("track_stride", stride)
                  .set("cameras", cameras);
  if (sequence.stereo)
    json.set("stereo", Json::object()
                           .set("left", sequence.stereo->left)
                           .set("right", sequence.stereo->right)
                           .set("baseline_m", sequence.stereo->baseline_m));
  return json;
}

/// The map and the cloud of a sequence.
void add_ground(Json& json, const Sequence& sequence, std::size_t number,
                const std::vector<const PageImage*>& images, const PageSource& source,
                std::size_t most_points, PageFolder& page) {
  const std::optional<MapArea> area = area_of(sequence, images);
  if (!area) return;
  std::optional<core::Image8> picture;
  if (source.ground_map) picture = source.ground_map(*area, kMapPx);
  const bool is_world = picture.has_value();
  if (!picture)
    if (std::optional<GroundPicture> relief = relief_of(images, sequence, *area))
      picture = std::move(relief->image);
  Json map = Json::object()
                 .set("west_m", area->west_m)
                 .set("east_m", area->east_m)
                 .set("south_m", area->south_m)
                 .set("north_m", area->north_m)
                 .set("source", !picture   ? "none"
                                : is_world ? "world"
                                           : "depth");
  if (picture) {
    const std::string file = fmt::format("ground/{:02}.png", number);
    page.write_png(file, *picture);
    map.set("file", file);
  }
  json.set("map", map);
  const Json cloud = cloud_of(images, sequence, most_points);
  if (cloud.at("count").integer() == 0) return;
  const std::string file = fmt::format("ground/{:02}.js", number);
  page.write(file, script_call("terracastCloud",
                               Json(cloud).set("sequence", static_cast<std::uint64_t>(number))));
  json.set("cloud", Json::object()
                        .set("file", file)
                        .set("count", cloud.at("count"))
                        .set("num_pixels", cloud.at("num_pixels")));
}

/// Histograms over the images shown.
Json statistics_json(const Dataset& dataset, const std::vector<PageImage>& images) {
  OctaveHistogram depths, flows;
  std::array<std::int64_t, 90> slopes{};
  std::map<std::string, std::int64_t> classes;
  std::map<std::pair<int, int>, std::pair<Json, Json>> overlaps;
  for (const PageImage& image : images) {
    const Sequence& sequence = dataset.sequences[static_cast<std::size_t>(image.place.sequence)];
    depths.add(image.depths_m);
    flows.add(image.flows_px);
    for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i] += image.slopes[i];
    for (const auto& [number, count] : image.classes) {
      const auto name = sequence.classes.find(number);
      classes[name == sequence.classes.end() ? fmt::format("class {}", number) : name->second] +=
          count;
    }
    if (!image.overlap) continue;
    auto& [frames, shares] =
        overlaps
            .try_emplace({image.place.sequence, image.place.camera}, Json::array(), Json::array())
            .first->second;
    frames.push(image.place.frame);
    shares.push(decimals(*image.overlap, 1e5));
  }
  Json slope_counts = Json::array();
  std::int64_t num_slopes = 0;
  for (const std::int64_t count : slopes) {
    slope_counts.push(count);
    num_slopes += count;
  }
  Json class_counts = Json::array();
  for (const auto& [name, count] : classes)
    class_counts.push(Json::object().set("name", name).set("count", count));
  Json overlap_lists = Json::array();
  for (const auto& [camera, lists] : overlaps)
    overlap_lists.push(Json::object()
                           .set("sequence", camera.first)
                           .set("camera", camera.second)
                           .set("frames", lists.first)
                           .set("shares", lists.second));
  Json json = Json::object().set("depth_m", depths.json()).set("flow_px", flows.json());
  json.set("slope_deg", num_slopes > 0 ? slope_counts : Json());
  return json.set("classes", class_counts).set("overlap", overlap_lists);
}

/// Files and bytes of dataset.json by what they hold.
Json sizes_json(const Dataset& dataset) {
  struct Size {
    std::int64_t num_files = 0;
    std::uint64_t num_bytes = 0;
  };
  std::map<std::string, const char*> kinds;
  for (const Sequence& sequence : dataset.sequences)
    for (const Camera& camera : sequence.cameras)
      for (const FrameFiles& files : camera.files) {
        const std::pair<const std::string*, const char*> all[] = {{&files.color, "colour"},
                                                                  {&files.depth, "depth"},
                                                                  {&files.segmentation, "classes"},
                                                                  {&files.flow, "flow"},
                                                                  {&files.disparity, "disparity"}};
        for (const auto& [file, kind] : all)
          if (!file->empty()) kinds.emplace(*file, kind);
      }
  std::map<std::string, Size> sizes;
  for (const auto& [path, record] : dataset.files) {
    const auto kind = kinds.find(path);
    Size& size = sizes[kind == kinds.end() ? "poses, calibration and the rest" : kind->second];
    ++size.num_files;
    size.num_bytes += record.num_bytes;
  }
  Json list = Json::array();
  for (const auto& [kind, size] : sizes)
    list.push(
        Json::object().set("kind", kind).set("files", size.num_files).set("bytes", size.num_bytes));
  return list;
}

/// Images, sequences, histograms and sizes of a dataset.
void add_dataset(Json& data, const std::vector<CheckResult>& results, const PageSource& source,
                 PageFolder& page) {
  const Dataset& dataset = *source.dataset;
  std::vector<Place> places;
  for (const CheckResult& result : results)
    if (const std::optional<Place> place = place_in(result.worst, dataset))
      places.push_back(*place);
  const std::vector<Place> chosen =
      dataset.sequences.empty() ? std::vector<Place>{} : choose_page_images(dataset, places);
  std::vector<PageImage> images(chosen.size());
  core::parallel_for(static_cast<std::int64_t>(chosen.size()), [&](std::int64_t i) {
    const auto index = static_cast<std::size_t>(i);
    PageImage& image = images[index];
    image = make_page_image(dataset, chosen[index], index);
    const std::string file = fmt::format("images/{:04}", index);
    if (!image.color.empty()) page.write_png(file + ".png", image.color);
    page.write(file + ".js", image.script);
    image.script = {};
  });
  Json list = Json::array();
  for (std::size_t i = 0; i < images.size(); ++i) list.push(image_json(images[i], i));
  std::int64_t num_images = 0;
  Json sequences = Json::array();
  for (std::size_t i = 0; i < dataset.sequences.size(); ++i) {
    const Sequence& sequence = dataset.sequences[i];
    num_images += sequence.num_frames * static_cast<std::int64_t>(sequence.cameras.size());
    std::vector<const PageImage*> shown;
    for (const PageImage& image : images)
      if (image.place.sequence == static_cast<int>(i)) shown.push_back(&image);
    Json json = sequence_json(sequence, pose_stride(dataset));
    if (!shown.empty())
      add_ground(json, sequence, i, shown, source,
                 std::max<std::size_t>(4000, kMostCloudPoints / dataset.sequences.size()), page);
    sequences.push(json);
  }
  data.set("sequences", sequences)
      .set("images", list)
      .set("num_images", num_images)
      .set("image_px", kPageImagePx)
      .set("far_depths", kFarDepths)
      .set("statistics", statistics_json(dataset, images))
      .set("sizes", sizes_json(dataset));
}

}  // namespace

Json stage_costs(const fs::path& events_file) {
  Json list = Json::array();
  std::ifstream file(events_file, std::ios::binary);
  if (events_file.empty() || !file) return list;
  constexpr std::streamoff kMostBytes = 1 << 20;
  file.seekg(0, std::ios::end);
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - kMostBytes));
  std::vector<std::string> order;
  std::map<std::string, Json> newest;
  for (std::string line; std::getline(file, line);) {
    if (line.find("\"stage\"") == std::string::npos) continue;
    try {
      const Json event = Json::parse(line, events_file.string());
      if (event.at("what").string() != "stage") continue;
      const std::string stage = event.at("stage").string();
      const Json cost = Json::object()
                            .set("stage", stage)
                            .set("wall_s", event.at("wall_s").number())
                            .set("cpu_s", event.at("cpu_s").number())
                            .set("peak_bytes", event.at("peak_bytes").number());
      if (!newest.contains(stage)) order.push_back(stage);
      newest[stage] = cost;
    } catch (const core::Error&) {
      // The first line may be cut, and others may write events of their own.
    }
  }
  for (const std::string& stage : order) list.push(newest.at(stage));
  return list;
}

CheckResult::Plot thinned(const CheckResult::Plot& plot, std::size_t most) {
  const std::size_t count = std::min(plot.x.size(), plot.y.size());
  CheckResult::Plot thin{plot.title, plot.x_label, plot.y_label, {}, {}};
  const std::size_t group = count <= most ? 1 : (2 * count + most - 1) / most;
  for (std::size_t begin = 0; begin < count; begin += group) {
    const std::size_t end = std::min(count, begin + group);
    std::size_t least = begin;
    std::size_t greatest = begin;
    for (std::size_t i = begin; i < end; ++i) {
      if (plot.y[i] < plot.y[least]) least = i;
      if (plot.y[i] > plot.y[greatest]) greatest = i;
    }
    for (const std::size_t i : {std::min(least, greatest), std::max(least, greatest)}) {
      thin.x.push_back(plot.x[i]);
      thin.y.push_back(plot.y[i]);
      if (least == greatest) break;
    }
  }
  return thin;
}

void write_page_data(const std::string& title, const std::vector<CheckResult>& results,
                     const Json& report, const PageSource& source, const fs::path& folder) {
  PageFolder page(folder / "page");
  page.write("page.js", page_script());
  page.write("page.css", page_style());
  Json data = Json::object().set("title", title).set("report", report);
  data.set("figures", figures_json(results, page)).set("stages", stage_costs(source.events_file));
  if (source.dataset != nullptr) {
    data.set("format", source.dataset->format).set("world", source.dataset->world_name);
    add_dataset(data, results, source, page);
  }
  // The size of the page names itself; a megabyte is enough to say.
  const std::uint64_t num_bytes = page.num_bytes() + data.text(-1).size();
  data.set("page_megabytes", decimals(1e-6 * static_cast<double>(num_bytes), 10.0));
  page.write("data.js", script_call("terracastData", data));
  page.remove_others();
}

}  // namespace terracast::validate

#include "tests/verdict/corruptions.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <span>
#include <variant>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/jobs/draws.h"
#include "tests/verdict/sensor_corruptions.h"
#include "tests/verdict/tables.h"
#include "validate/npy.h"

namespace terracast::test {

namespace {

namespace fs = std::filesystem;

/// Files below a folder whose path from it holds one of some words, by the folder that they lie in; in order.
std::map<fs::path, std::vector<fs::path>> files_of(const fs::path& folder,
                                                   const std::vector<std::string>& words,
                                                   const std::string& extension) {
  std::map<fs::path, std::vector<fs::path>> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string path = entry.path().lexically_relative(folder).generic_string();
    if (entry.is_regular_file() && entry.path().extension() == extension &&
        std::any_of(words.begin(), words.end(),
                    [&](const std::string& word) { return path.find(word) != std::string::npos; }))
      found[entry.path().parent_path()].push_back(entry.path());
  }
  for (auto& [place, files] : found) std::sort(files.begin(), files.end());
  return found;
}

/// One of several folders of files.
const std::vector<fs::path>& one_of(const std::map<fs::path, std::vector<fs::path>>& files,
                                    Draws& draws) {
  return std::next(files.begin(), draws.below(static_cast<int>(files.size())))->second;
}

core::Image8 image_of(const fs::path& file) {
  return std::get<core::Image8>(core::decode_png(core::read_file(file), file.string()));
}

/// Of eight bits, in colour or grey.
std::map<fs::path, std::vector<fs::path>> images_of(const fs::path& folder) {
  auto images = files_of(folder, {"image"}, ".png");
  std::erase_if(images, [](const auto& one) {
    const fs::path& file = one.second.front();
    return !std::holds_alternative<core::Image8>(
        core::decode_png(core::read_file(file), file.string()));
  });
  return images;
}

/// Changes the float32 numbers of an npy file, all of which lie at its end.
void edit_floats(const fs::path& file, const std::function<void(std::span<float>)>& change) {
  std::vector<std::byte> bytes = core::read_file(file);
  const std::size_t size = validate::parse_npy(bytes, file.string()).bytes.size();
  std::vector<float> values(size / sizeof(float));
  std::memcpy(values.data(), bytes.data() + bytes.size() - size, size);
  change(values);
  std::memcpy(bytes.data() + bytes.size() - size, values.data(), size);
  core::write_file(file, bytes);
}

/// The files of one camera, of several frames, of which the first and the last change places.
bool exchange(std::map<fs::path, std::vector<fs::path>> files, Draws& draws) {
  std::erase_if(files, [](const auto& one) { return one.second.size() < 2; });
  if (files.empty()) return false;
  const std::vector<fs::path>& camera = one_of(files, draws);
  const std::vector<std::byte> first = core::read_file(camera.front());
  const std::vector<std::byte> last = core::read_file(camera.back());
  if (first == last) return false;
  core::write_file(camera.front(), last);
  core::write_file(camera.back(), first);
  return true;
}

/// How alike two images are: the correlation of their numbers.
double likeness_of(const core::Image8& a, const core::Image8& b) {
  if (a.data().size() != b.data().size()) return 0.0;
  double sum_a = 0.0, sum_b = 0.0, sum_aa = 0.0, sum_bb = 0.0, sum_ab = 0.0;
  const auto count = static_cast<double>(a.data().size());
  for (std::size_t i = 0; i < a.data().size(); ++i) {
    const double of_a = a.data()[i], of_b = b.data()[i];
    sum_a += of_a;
    sum_b += of_b;
    sum_aa += of_a * of_a;
    sum_bb += of_b * of_b;
    sum_ab += of_a * of_b;
  }
  const double both = (sum_aa - sum_a * sum_a / count) * (sum_bb - sum_b * sum_b / count);
  return both > 0.0 ? (sum_ab - sum_a * sum_b / count) / std::sqrt(both) : 1.0;
}

bool exchange_images(const fs::path& folder, Draws& draws, double) {
  // The images of two frames are nearly the same where hardly anything moves.
  constexpr double kSame = 0.5;
  auto images = images_of(folder);
  std::erase_if(images, [&](const auto& one) {
    return likeness_of(image_of(one.second.front()), image_of(one.second.back())) > kSame;
  });
  return exchange(std::move(images), draws);
}

std::map<fs::path, std::vector<fs::path>> depths_of(const fs::path& folder) {
  return files_of(folder, {"depth", "range/"}, ".npy");
}

/// How much longer or shorter half of the depths of one file are than another's.
double difference_of(const fs::path& a, const fs::path& b) {
  std::vector<float> first, second, sizes;
  const auto take = [](std::vector<float>& into) {
    return [&into](std::span<float> values) { into.assign(values.begin(), values.end()); };
  };
  edit_floats(a, take(first));
  edit_floats(b, take(second));
  for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i)
    // Of sky, which formats call 0 or infinite, there is no share.
    if (std::isfinite(first[i]) && std::isfinite(second[i]) && first[i] > 0.0F && second[i] > 0.0F)
      sizes.push_back(std::abs(first[i] / second[i] - 1.0F));
  if (sizes.empty()) return 0.0;
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2),
                   sizes.end());
  return sizes[sizes.size() / 2];
}

bool exchange_depths(const fs::path& folder, Draws& draws, double) {
  // Over level ground the depths of two frames are the same.
  constexpr double kSame = 0.02;
  auto depths = depths_of(folder);
  std::erase_if(depths, [&](const auto& one) {
    return difference_of(one.second.front(), one.second.back()) < kSame;
  });
  return exchange(std::move(depths), draws);
}

/// All images of a camera, each pixel by the others.
bool edit_images(const fs::path& folder, Draws& draws,
                 const std::function<std::uint8_t(const core::Image8&, int, int, int)>& pixel) {
  const auto images = images_of(folder);
  if (images.empty()) return false;
  bool is_changed = false;
  for (const fs::path& file : one_of(images, draws)) {
    const core::Image8 image = image_of(file);
    core::Image8 edited = image;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        for (int k = 0; k < image.channels(); ++k) edited(x, y, k) = pixel(image, x, y, k);
    is_changed =
        is_changed || !std::equal(image.data().begin(), image.data().end(), edited.data().begin());
    core::write_file(file, core::encode_png(edited));
  }
  return is_changed;
}

bool turn_images(const fs::path& folder, Draws& draws, double) {
  return edit_images(folder, draws, [](const core::Image8& image, int x, int y, int k) {
    return image(x, image.height() - 1 - y, k);
  });
}

/// Red for blue in one camera of several.
bool swap_channels(const fs::path& folder, Draws& draws, double) {
  auto images = images_of(folder);
  std::erase_if(images,
                [](const auto& one) { return image_of(one.second.front()).channels() != 3; });
  if (images.size() < 2) return false;
  bool is_changed = false;
  for (const fs::path& file : one_of(images, draws)) {
    core::Image8 image = image_of(file);
    for (std::size_t i = 0; i + 2 < image.data().size(); i += 3) {
      is_changed |= image.data()[i] != image.data()[i + 2];
      std::swap(image.data()[i], image.data()[i + 2]);
    }
    core::write_file(file, core::encode_png(image));
  }
  return is_changed;
}

/// The images of two cameras, all of them.
bool exchange_cameras(const fs::path& folder, Draws& draws, double) {
  const auto images = images_of(folder);
  if (images.size() < 2) return false;
  const auto first = std::next(images.begin(), draws.below(static_cast<int>(images.size()) - 1));
  const auto second = std::next(first);
  constexpr double kSame = 0.9;
  if (first->second.size() != second->second.size() ||
      likeness_of(image_of(first->second.front()), image_of(second->second.front())) > kSame ||
      image_of(first->second.front()).data().size() !=
          image_of(second->second.front()).data().size())
    return false;
  for (std::size_t i = 0; i < first->second.size(); ++i) {
    const std::vector<std::byte> of_first = core::read_file(first->second[i]);
    core::write_file(first->second[i], core::read_file(second->second[i]));
    core::write_file(second->second[i], of_first);
  }
  return true;
}

/// Along rows, by the line between two pixels.
bool shift_images(const fs::path& folder, Draws& draws, double shift_px) {
  return edit_images(folder, draws, [=](const core::Image8& image, int x, int y, int k) {
    const double at = std::clamp(x - shift_px, 0.0, image.width() - 1.0);
    const int left = std::min(static_cast<int>(at), image.width() - 2);
    const double part = at - left;
    return static_cast<std::uint8_t>(
        std::lround((1.0 - part) * image(left, y, k) + part * image(left + 1, y, k)));
  });
}

/// All depths of a camera.
bool scale_depths(const fs::path& folder, Draws& draws, double percent) {
  const auto depths = depths_of(folder);
  if (depths.empty()) return false;
  const auto factor = static_cast<float>(1.0 + 0.01 * percent);
  for (const fs::path& file : one_of(depths, draws))
    edit_floats(file, [&](std::span<float> values) {
      for (float& value : values) value *= factor;
    });
  return true;
}

/// All depths of a camera, as half precision has them: eleven bits.
bool halve_precision(const fs::path& folder, Draws& draws, double) {
  const auto depths = depths_of(folder);
  if (depths.empty()) return false;
  for (const fs::path& file : one_of(depths, draws))
    edit_floats(file, [&](std::span<float> values) {
      for (float& value : values) value = static_cast<float>(static_cast<Eigen::half>(value));
    });
  return true;
}

/// All flow of a camera in one direction.
bool edit_flow(const fs::path& folder, Draws& draws,
               const std::function<void(std::span<float>)>& change) {
  auto flows = files_of(folder, {"flow"}, ".npy");
  for (auto& [place, files] : flows)
    std::erase_if(files, [](const fs::path& file) {
      return file.filename().string().find("mask") != std::string::npos;
    });
  std::erase_if(flows, [](const auto& one) { return one.second.empty(); });
  if (flows.empty()) return false;
  for (const fs::path& file : one_of(flows, draws)) edit_floats(file, change);
  return true;
}

bool negate_flow(const fs::path& folder, Draws& draws, double) {
  return edit_flow(folder, draws, [](std::span<float> values) {
    for (float& value : values) value = -value;
  });
}

/// Right for down.
bool exchange_components(const fs::path& folder, Draws& draws, double) {
  double most_px = 0.0;
  const bool is_edited = edit_flow(folder, draws, [&](std::span<float> values) {
    for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
      if (std::isfinite(values[i]) && std::isfinite(values[i + 1]))
        most_px = std::max(most_px, std::abs(static_cast<double>(values[i] - values[i + 1])));
      std::swap(values[i], values[i + 1]);
    }
  });
  constexpr double kVisible_px = 0.5;
  return is_edited && most_px > kVisible_px;
}

/// To the right.
bool shift_flow(const fs::path& folder, Draws& draws, double shift_px) {
  return edit_flow(folder, draws, [=](std::span<float> values) {
    for (std::size_t i = 0; i < values.size(); i += 2) values[i] += static_cast<float>(shift_px);
  });
}

/// One camera's place in one frame, to the north.
bool move_place(const fs::path& folder, Draws& draws, double distance_m) {
  std::vector<PoseTable> places = place_tables_of(folder);
  if (places.empty()) return false;
  std::string& latitude = places.front().table.draw_row(draws)[places.front().place[0]];
  constexpr double kMetresPerDegree = 111320.0;  // to one percent, at any latitude
  latitude = fmt::format("{:.14f}", number_of(latitude) + distance_m / kMetresPerDegree);
  places.front().table.write();
  return true;
}

/// All places.
bool raise_places(const fs::path& folder, Draws&, double height_m) {
  std::vector<PoseTable> places = place_tables_of(folder);
  if (places.empty()) return false;
  for (PoseTable& one : places) {
    for (std::size_t i = 1; i < one.table.rows.size(); ++i) {
      std::string& height = one.table.rows[i][one.place[2]];
      height = text_of(number_of(height) + height_m);
    }
    one.table.write();
  }
  return true;
}

bool move_time(const fs::path& folder, Draws& draws, double time_s) {
  std::vector<PoseTable> places = place_tables_of(folder);
  if (places.empty()) return false;
  constexpr std::size_t kTime = 2;
  std::string& time = places.front().table.draw_row(draws)[kTime];
  time = text_of(number_of(time) + time_s);
  places.front().table.write();
  return true;
}

/// One pose, along one axis.
bool move_pose(const fs::path& folder, Draws& draws, double distance_m) {
  std::vector<PoseTable> tables = pose_tables_of(folder);
  if (tables.empty()) return false;
  PoseTable& poses = tables[static_cast<std::size_t>(draws.below(static_cast<int>(tables.size())))];
  std::string& value = poses.table.draw_row(
      draws, poses.first_row)[poses.place[static_cast<std::size_t>(draws.below(3))]];
  value = text_of(number_of(value) + distance_m);
  poses.table.write();
  return true;
}

/// One pose, about one of its axes.
bool turn_pose(const fs::path& folder, Draws& draws, double angle_deg) {
  std::vector<PoseTable> tables = pose_tables_of(folder);
  if (tables.empty()) return false;
  PoseTable& poses = tables[static_cast<std::size_t>(draws.below(static_cast<int>(tables.size())))];
  constexpr double kRadians = 3.14159265358979 / 180.0;
  const Eigen::Quaterniond by(
      Eigen::AngleAxisd(kRadians * angle_deg, Eigen::Vector3d::Unit(draws.below(3))));
  turn_row(poses.table.draw_row(draws, poses.first_row), poses, by);
  poses.table.write();
  return true;
}

/// The forward velocity of one packet of KITTI's.
bool change_packet(const fs::path& folder, Draws& draws, double speed_mps) {
  const auto packets = files_of(folder, {"oxts/data/"}, ".txt");
  if (packets.empty()) return false;
  const std::vector<fs::path>& files = packets.begin()->second;
  Table packet = read_table(
      files[static_cast<std::size_t>(draws.below(static_cast<int>(files.size())))], ' ', false);
  constexpr std::size_t kForward = 8;
  std::string& value = packet.rows.front()[kForward];
  value = text_of(number_of(value) + speed_mps);
  packet.write();
  return true;
}

}  // namespace

const std::vector<Corruption>& corruptions() {
  static const std::vector<Corruption> of_images{
      {"depths of a camera scaled",
       "%",
       0.01,
       20.0,
       &scale_depths,
       {"reprojection_scale", "stereo_scale"},
       {"reprojection", "reprojection_scale"},
       {"depth_scale", "depth_unit", "focal_length", "baseline", "disparity_scale"}},
      {"flow of a camera off", "px", 1e-3, 3.0, &shift_flow, {"flow"}, {"flow"}, {"flow_offset"}},
      {"a place moved",
       "m",
       1e-4,
       10.0,
       &move_place,
       {"georeference_position"},
       {"georeference_position"},
       {"place_row"}},
      {"images of a camera shifted",
       "px",
       0.03,
       10.0,
       &shift_images,
       {"photometric_principal_point"},
       {"photometric_principal_point", "photometric_correlation", "photometric_cameras"},
       {"images_shifted", "principal_point", "color_shifted"}},
      {"images of two frames exchanged",
       "",
       0.0,
       0.0,
       &exchange_images,
       {},
       {"photometric_frames", "photometric_correlation", "photometric_cameras"},
       {"color_order", "frame_foreign", "frame_duplicated"}},
      {"depths of two frames exchanged",
       "",
       0.0,
       0.0,
       &exchange_depths,
       {},
       {"reprojection", "reprojection_see_through", "reprojection_position"},
       {"depth_order", "depth_shifted", "depth_foreign", "frame_foreign"}},
      {"images of a camera upside down",
       "",
       0.0,
       0.0,
       &turn_images,
       {},
       {"photometric_correlation", "photometric_frames", "photometric_cameras",
        // A camera that hardly moves shows the same in all frames, upside down or not.
        "photometric_principal_point", "photometric_rotation"},
       {"color_flipped"}},
      {"flow of a camera negated", "", 0.0, 0.0, &negate_flow, {}, {"flow"}, {"flow_sign"}},
      {"a pose moved",
       "m",
       1e-4,
       10.0,
       &move_pose,
       {"georeference_position"},
       {"georeference_position"},
       {"pose_row", "position", "place_row", "depth_foreign"}},
      {"a pose turned",
       "deg",
       1e-4,
       30.0,
       &turn_pose,
       {"georeference_rotation"},
       {"georeference_rotation"},
       {"pose_row", "rotation", "place_row", "depth_foreign"}},
      {"a time moved",
       "s",
       1e-6,
       1.0,
       &move_time,
       {"georeference_time"},
       {"georeference_time"},
       {"time_row"}},
      {"all places raised",
       "m",
       1e-4,
       100.0,
       &raise_places,
       {"georeference_origin"},
       {"georeference_origin", "georeference_position"},
       {"height_offset", "geoid", "place_offset"}},
      {"a packet's velocity off",
       "m/s",
       1e-7,
       1.0,
       &change_packet,
       {"oxts_levelled"},
       {"oxts_levelled", "oxts_velocity"},
       {}},
      {"red and blue of a camera swapped",
       "",
       0.0,
       0.0,
       &swap_channels,
       {},
       {"photometric_channels", "colors_plants"},
       {"channel_order"}},
      {"images of two cameras exchanged",
       "",
       0.0,
       0.0,
       &exchange_cameras,
       {},
       {"photometric_correlation", "photometric_cameras", "photometric_frames"},
       {"cameras_swapped", "images_swapped"}},
      {"depths of a camera in half precision",
       "",
       0.0,
       0.0,
       &halve_precision,
       {},
       {"depth_levels", "depth_steps", "reprojection"},
       {"depth_float16", "depth_levels"}},
      {"components of flow exchanged",
       "",
       0.0,
       0.0,
       &exchange_components,
       {},
       {"flow"},
       {"flow_order"}}};
  static const std::vector<Corruption> all = [] {
    std::vector<Corruption> list = of_images;
    for (const Corruption& one : plain_sensor_corruptions()) list.push_back(one);
    return list;
  }();
  return all;
}

}  // namespace terracast::test
